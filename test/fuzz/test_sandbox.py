"""The sandbox sees every way to fall."""

import ctypes
import sys
import time
import warnings

import pytest

from diff_encoder_sim.base.errors import ConfigError
from sandbox import ACCEPTED, FALLEN, REFUSED, Limits, run_in_sandbox


def refuse():
    raise ConfigError('file: key: given 1; allowed: 2')


def compute_for_ever():
    while True:
        pass


CASES = {
    'done': (lambda: None, ACCEPTED, ''),
    'refused': (refuse, REFUSED, 'given 1; allowed: 2'),
    'two lines': (lambda: sys.exit('file: key\ngiven 1'), FALLEN, 'not one printable line'),
    'no line': (lambda: sys.exit(3), FALLEN, 'ends with 3'),
    'traceback': (lambda: {}['key'], FALLEN, 'KeyError at test_sandbox.py'),
    'computes': (compute_for_ever, FALLEN, 'no end within 1 s of processor time'),
    'sleeps': (lambda: time.sleep(1e6), FALLEN, 'no end within 2 s'),
    'memory': (lambda: [bytearray(1 << 20) for _ in range(10_000)], FALLEN, 'MemoryError'),
    'signal': (lambda: ctypes.string_at(0), FALLEN, 'killed by signal 11'),
    'warning': (lambda: warnings.warn('overflow', RuntimeWarning, stacklevel=1), FALLEN, 'RuntimeWarning: overflow'),
}


@pytest.mark.parametrize('case', CASES)
def test_a_case_is_judged_by_how_it_ends(case, tmp_path, monkeypatch):
    run, kind, reason = CASES[case]
    monkeypatch.setattr('sandbox.WALL_PER_CPU', 2 if case == 'sleeps' else 10)
    verdict = run_in_sandbox(run, tmp_path, Limits(cpu_s=1, memory_mib=200))
    assert verdict.kind == kind and reason in verdict.reason
