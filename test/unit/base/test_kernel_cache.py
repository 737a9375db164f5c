"""Code of kernels that processes share: one of them compiles, none runs old code, and no file or lock stops any."""

import errno
import fcntl
import logging
import multiprocessing
import os
import subprocess
import sys

import numba
import pytest

from diff_encoder_sim.base import kernel_cache
from diff_encoder_sim.base.kernel_cache import keep_code
from diff_encoder_sim.base.machine_code import SAID_VARIABLE
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


class Kept:
    """A folder of kept code, and its user: each dispatcher is as new to it as that of another process."""

    def __init__(self, folder):
        self.folder = folder

    def times(self, factor, file='times.py'):
        """Return a dispatcher whose bytecode does not tell its factor, as numba's own key does not."""
        (self.folder / 'times.py').write_text('')
        names = {'__builtins__': {}}  # where libraries keep things that numba 0.58 cannot write
        exec(compile(f'def times(x): return {factor} * x', str(self.folder / file), 'exec'), names)
        dispatcher = numba.njit(names['times'])
        keep_code(dispatcher, [f'factor {factor}'])
        return dispatcher

    def files(self, suffix=''):
        return sorted(self.folder.glob(f'code/*/*{suffix}'))


@pytest.fixture
def kept(tmp_path, monkeypatch):
    numba.config.reload_config()  # after another test's changes of the environment; compiling would do it
    monkeypatch.setattr(numba.config, 'CACHE_DIR', str(tmp_path / 'code'))
    monkeypatch.setenv(SAID_VARIABLE, '')
    monkeypatch.delenv(SAID_VARIABLE)
    return Kept(tmp_path)


@pytest.fixture
def no_waiting(monkeypatch):
    def sleep(seconds):
        raise AssertionError('waits for a lock')

    monkeypatch.setattr(kernel_cache.time, 'sleep', sleep)


def hits(dispatcher):
    return sum(dispatcher.stats.cache_hits.values())


def test_code_is_found_by_the_next_and_that_of_an_older_source_is_removed(kept):
    assert kept.times(2)(3) == 6
    again = kept.times(2)
    assert (again(3), hits(again)) == (6, 1)
    newer = kept.times(5)
    assert (newer(3), hits(newer)) == (15, 0)
    assert [file.suffix for file in kept.files()] == ['.nbc', '.nbi']


def test_an_index_has_the_code_of_all_signatures(kept):
    kernel = kept.times(2)
    assert (kernel(3), kernel(1.5)) == (6, 3.0)
    again = kept.times(2)
    assert (again(3), again(1.5), hits(again)) == (6, 3.0, 2)


@pytest.mark.parametrize('files', [0, 1])
def test_no_old_code_is_run_after_a_process_was_killed_between_two_files(kept, files):
    kept.times(2)(3)
    replace = os.replace
    written = []

    def replace_or_die(*names):
        if len(written) == files:
            os._exit(9)
        written.append(names)
        replace(*names)

    def die():
        os.replace = replace_or_die
        kept.times(5)(3)

    process = multiprocessing.get_context('fork').Process(target=die)
    process.start()
    process.join()
    assert process.exitcode == 9
    next_one = kept.times(5)
    assert (next_one(3), hits(next_one)) == (15, 0)
    assert len(kept.files('.nbc')) == 1


@pytest.mark.parametrize('files', [0, 1])
def test_a_full_disk_ends_nothing_and_is_said_once(kept, monkeypatch, caplog, files):
    kept.times(2)(3)
    replace = os.replace
    written = []

    def replace_or_fail(*names):
        if len(written) == files:
            raise OSError(errno.ENOSPC, 'No space left on device')
        written.append(names)
        replace(*names)

    with monkeypatch.context() as full:
        full.setattr(os, 'replace', replace_or_fail)
        kernel = kept.times(5)
        assert (kernel(3), kernel(1.5)) == (15, 7.5)
    (said,) = caplog.messages
    assert str(kept.files('.nbi')[0].parent) in said and 'No space left on device' in said
    assert kept.times(5)(3) == 15


def test_where_numba_finds_no_folder_kernels_run_and_that_is_said_once(kept, caplog):
    assert [kept.times(factor, 'not_there.py')(3) for factor in (2, 5)] == [6, 15]
    (said,) = caplog.messages
    assert str(kept.folder) in said
    assert kept.files() == []


def cut(file):
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])


def make_unreadable(file):  # for root, too: a link to itself
    file.unlink()
    file.symlink_to(file)


@pytest.mark.parametrize('suffix', ['.nbi', '.nbc'])
@pytest.mark.parametrize(
    'spoil',
    [cut, make_unreadable, lambda file: file.write_bytes(b''), lambda file: file.write_bytes(b'\x80\x04N.')],
    ids=['torn', 'unreadable', 'empty', 'of something else'],
)
def test_a_file_that_cannot_be_used_is_replaced(kept, suffix, spoil):
    kept.times(2)(3)
    spoil(kept.files(suffix)[0])
    kernel, again = kept.times(2), kept.times(2)
    assert (kernel(3), hits(kernel)) == (6, 0)
    assert (again(3), hits(again)) == (6, 1)


@pytest.mark.parametrize('failure', [KeyboardInterrupt, numba.core.errors.TypingError])
def test_nobody_waits_for_one_whose_compiling_was_ended(kept, monkeypatch, no_waiting, failure):
    ended = kept.times(2)

    def fail(*arguments):
        raise failure('as told')

    monkeypatch.setattr(ended._compiler, 'compile', fail)
    with pytest.raises(failure):
        ended(3)
    assert kept.times(2)(3) == 6
    assert kept.files('.lock') == []


def test_one_who_has_waited_too_long_says_so_and_compiles_too(kept, monkeypatch, caplog):
    monkeypatch.setattr(kernel_cache, 'PATIENCE_S', 0.2)
    slow, other = kept.times(2), kept.times(2)
    compile_of_numba = slow._compiler.compile

    def compile_slowly(*arguments):
        assert other(3) == 6
        return compile_of_numba(*arguments)

    monkeypatch.setattr(slow._compiler, 'compile', compile_slowly)
    assert slow(3) == 6
    ((_, level, said),) = caplog.record_tuples
    assert level == logging.WARNING
    assert str(kept.files('.nbi')[0].parent) in said and 'another process' in said
    assert kept.files('.lock') == []


def test_one_who_has_waited_uses_the_code_that_the_other_one_kept(kept, monkeypatch):
    kept.times(5)(3)
    path = kept.files('.nbi')[0].with_suffix('.lock')
    lock = path.open('ab')
    fcntl.flock(lock, fcntl.LOCK_EX)

    def let_the_other_end(seconds):
        path.unlink()
        lock.close()
        assert kept.times(2)(3) == 6

    monkeypatch.setattr(kernel_cache.time, 'sleep', let_the_other_end)
    waiting = kept.times(2)
    assert (waiting(3), hits(waiting)) == (6, 1)


def test_what_is_locked_is_open_for_writing_as_nfs_needs_it(kept, monkeypatch):
    modes = []

    def flock(file, operation):
        modes.append(fcntl.fcntl(file, fcntl.F_GETFL) & os.O_ACCMODE)

    monkeypatch.setattr(kernel_cache.fcntl, 'flock', flock)
    kept.times(2)(3)
    assert modes and os.O_RDONLY not in modes


def test_where_a_file_system_has_no_locks_nobody_waits(kept, monkeypatch, no_waiting, caplog):
    def flock(file, operation):
        raise OSError(errno.ENOLCK, 'No locks available')

    monkeypatch.setattr(kernel_cache.fcntl, 'flock', flock)
    kernel, again = kept.times(2), kept.times(2)
    assert (kernel(3), again(3), hits(again)) == (6, 6, 1)
    assert caplog.messages == []
