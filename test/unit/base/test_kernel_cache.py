"""Of several processes that need the same kernel, one compiles it."""

import os
import subprocess
import sys

import pytest

from diff_encoder_sim.base.kernel_cache import only_process
from places import ROOT

# Kernels that call each other; each compilation is written down.
MODULE = """
import os, sys
from numba.core import event
from diff_encoder_sim.base.compiled import compiled

class Log(event.Listener):
    def on_start(self, begun):
        print('compiles', begun.data['dispatcher'].py_func.__name__, flush=True)
    def on_end(self, ended):
        pass

event.register('numba:compile', Log())

@compiled
def inner(number):
    return number + 1.0

@compiled
def outer(numbers):
    total = 0.0
    for number in numbers:
        total += inner(number)
    return total
"""


@pytest.fixture
def started(tmp_path):
    """Start processes that call the outer kernel at once, and return what they print."""
    (tmp_path / 'kernels_of_test.py').write_text(MODULE)

    def start(count):
        path = os.pathsep.join([str(tmp_path), str(ROOT / 'src')])
        environment = {**os.environ, 'PYTHONPATH': path, 'NUMBA_CACHE_DIR': str(tmp_path / 'code')}
        command = [sys.executable, '-c', 'import numpy, kernels_of_test as k; print(k.outer(numpy.arange(3.0)))']
        processes = [
            subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            for _ in range(count)
        ]
        outputs = [process.communicate(timeout=120) for process in processes]
        assert [error for _, error in outputs] == [''] * count
        return sorted(line for output, _ in outputs for line in output.splitlines())

    return start


def test_two_processes_compile_each_kernel_once_and_a_third_none(started):
    assert started(2) == ['6.0', '6.0', 'compiles inner', 'compiles outer']
    assert started(1) == ['6.0']


def test_a_folder_is_held_by_one_process_and_by_that_again(tmp_path):
    folder = tmp_path / 'new'
    other = f'import fcntl, os, sys; fcntl.flock(os.open({str(folder)!r}, os.O_RDONLY), fcntl.LOCK_EX | fcntl.LOCK_NB)'
    with only_process(str(folder)):
        with only_process(str(folder)):
            pass
        held = subprocess.run([sys.executable, '-c', other], capture_output=True, text=True)
    assert 'BlockingIOError' in held.stderr
    assert subprocess.run([sys.executable, '-c', other]).returncode == 0


def test_without_a_folder_nobody_waits(tmp_path):
    (tmp_path / 'file').write_text('')
    with only_process(str(tmp_path / 'file' / 'code')):
        pass
