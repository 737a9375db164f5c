"""Compiling ahead of trials."""

import subprocess
import sys

from places import SOURCE, SUPPORT

TRIAL_AFTER_WARM_UP = """
import importlib, pkgutil
import diff_encoder_sim
from diff_encoder_sim.base.kernels import Kernel
from diff_encoder_sim.trials.kernels_warm_up import PARTS
from lockstep_trials import BEND, ended, lockstep

ROOMS = [importlib.import_module(f'diff_encoder_sim.{name}') for name in ('localization', 'navigation', 'simulation')]

def compiled():
    return {f'{module.name}.{name}': len(value.signatures)
            for room in ROOMS for module in pkgutil.iter_modules(room.__path__, room.__name__ + '.')
            for name, value in vars(importlib.import_module(module.name)).items() if isinstance(value, Kernel)}

for part in PARTS: part()
before = compiled()
assert sum(before.values()) > 20, before
ended(lockstep(BEND))
assert compiled() == before, {name: count for name, count in compiled().items() if count != before[name]}
"""


def test_nothing_is_left_to_compile_in_a_trial():
    result = subprocess.run(
        [sys.executable, '-c', TRIAL_AFTER_WARM_UP],
        cwd=str(SUPPORT),
        capture_output=True,
        text=True,
        env={'PYTHONPATH': f'{SOURCE}:{SUPPORT}', 'PATH': ''},
    )
    assert result.returncode == 0, result.stderr
