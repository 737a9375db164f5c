"""Compiling ahead."""

import subprocess
import sys

import pytest

from places import SOURCE, SUPPORT

NOTHING_IS_COMPILED_AFTER = """
import importlib, pkgutil, sys
import numpy as np
from diff_encoder_sim import localization
from diff_encoder_sim.localization.amcl import Amcl
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.amcl import warm_up
from amcl_world import pillar_room, simulated_scan
from diff_encoder_sim.base.se2 import Pose2D

modules = [importlib.import_module(localization.__name__ + '.' + found.name)
           for found in pkgutil.iter_modules(localization.__path__)]

def signatures():
    return {(kernel.__module__, name): kernel.signatures for module in modules
            for name, kernel in vars(module).items() if hasattr(kernel, 'signatures')}

params = AmclParams(laser_model_type=sys.argv[1], do_beamskip=True, lost_fraction=0.5,
                    max_particles=500, resample_interval=1)
warm_up(params)
before = {key: list(found) for key, found in signatures().items()}
assert sum(map(len, before.values())) >= 6, before
room = pillar_room()
amcl = Amcl(params, room, np.random.default_rng(0))
for step in range(6):
    pose = Pose2D(0.3 * step - 1.0, 0.0, 0.1)
    amcl.update(pose, simulated_scan(room, pose), Pose2D(0.1, 0.0, 0.2))
after = signatures()
assert before == after, {key: (before[key], after[key]) for key in after if before[key] != after[key]}
"""


@pytest.mark.parametrize('model', ['likelihood_field', 'likelihood_field_prob', 'beam'])
def test_after_the_warm_up_nothing_is_left_to_compile(model):
    result = subprocess.run(
        [sys.executable, '-c', NOTHING_IS_COMPILED_AFTER, model],
        cwd=str(SOURCE),
        env={'PYTHONPATH': f'{SOURCE}:{SUPPORT}', 'PATH': ''},
        capture_output=True,
        text=True,
    )
    assert result.returncode == 0, result.stderr[-2000:]
