"""Whether a warm-up has compiled all kernels of rooms that a program needs."""

import subprocess
import sys

from places import SOURCE, SUPPORT

PROGRAM = """
import importlib, pkgutil
from diff_encoder_sim.base.kernels import Kernel

rooms = [importlib.import_module('diff_encoder_sim.' + room) for room in '{rooms}'.split()]
modules = [importlib.import_module(room.__name__ + '.' + found.name)
           for room in rooms for found in pkgutil.iter_modules(room.__path__)]

def signatures():
    return {{(kernel.__module__, name): len(kernel.signatures) for module in modules
            for name, kernel in vars(module).items() if isinstance(kernel, Kernel)}}

{warm_up}
before = signatures()
assert sum(before.values()) > 5, before
{work}
assert signatures() == before, (before, signatures())
"""


def check_nothing_is_left_to_compile(rooms, warm_up, work):
    """Run a warm-up and then work, both as text, in a process of their own."""
    command = [sys.executable, '-c', PROGRAM.format(rooms=rooms, warm_up=warm_up, work=work)]
    environment = {'PYTHONPATH': f'{SOURCE}:{SUPPORT}', 'PATH': ''}
    result = subprocess.run(command, cwd=str(SUPPORT), capture_output=True, text=True, env=environment)
    assert result.returncode == 0, result.stderr[-2000:]
