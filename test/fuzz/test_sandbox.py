"""The sandbox sees every way to fall."""

import ctypes
import sys
import time
import warnings

import pytest

from diff_encoder_sim.base.errors import ConfigError
from sandbox import ACCEPTED, FALLEN, REFUSED, Limits, run_in_sandbox

LIMITS = Limits(cpu_s=1, memory_mib=200)


def refuse():
    raise ConfigError('file: key: given 1; allowed: 2')


def refuse_in_two_lines():
    sys.exit('file: key\ngiven 1')


def end_without_a_line():
    sys.exit(3)


def stumble():
    return {}['key']


def compute_for_ever():
    while True:
        pass


def sleep_for_ever():
    time.sleep(1e6)


def fill_memory():
    return [bytearray(1 << 20) for _ in range(10_000)]


def read_nowhere():
    ctypes.string_at(0)


def warn():
    warnings.warn('overflow', RuntimeWarning, stacklevel=1)


@pytest.mark.parametrize(
    ('run', 'kind', 'reason'),
    [
        (lambda: None, ACCEPTED, ''),
        (refuse, REFUSED, 'given 1; allowed: 2'),
        (lambda: sys.exit('campaign: no such file'), REFUSED, 'no such file'),
        (refuse_in_two_lines, FALLEN, 'not one printable line'),
        (end_without_a_line, FALLEN, 'ends with 3'),
        (stumble, FALLEN, "KeyError at test_sandbox.py:29: 'key'"),
        (compute_for_ever, FALLEN, 'no end within 1 s of processor time'),
        (sleep_for_ever, FALLEN, 'no end within 2 s'),
        (fill_memory, FALLEN, 'MemoryError'),
        (read_nowhere, FALLEN, 'killed by signal 11'),
        (warn, FALLEN, 'RuntimeWarning: overflow'),
    ],
    ids=lambda value: getattr(value, '__name__', None),
)
def test_a_case_is_judged_by_how_it_ends(run, kind, reason, tmp_path, monkeypatch):
    if run is sleep_for_ever:
        monkeypatch.setattr('sandbox.WALL_PER_CPU', 2)
    verdict = run_in_sandbox(run, tmp_path, LIMITS)
    assert verdict.kind == kind
    assert reason in verdict.reason
