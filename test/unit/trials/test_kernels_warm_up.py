"""Compiling ahead of trials and nodes."""

import subprocess
import sys

import pytest

from places import SOURCE, SUPPORT

PROGRAM = """
import importlib, pkgutil
import numpy as np
from diff_encoder_sim.base.kernels import Kernel
from diff_encoder_sim.base.se2 import Pose2D

ROOMS = [importlib.import_module(f'diff_encoder_sim.{name}') for name in ('localization', 'navigation', 'simulation')]

def compiled():
    return {f'{module.name}.{name}': len(value.signatures)
            for room in ROOMS for module in pkgutil.iter_modules(room.__path__, room.__name__ + '.')
            for name, value in vars(importlib.import_module(module.name)).items() if isinstance(value, Kernel)}

%s
before = compiled()
assert sum(before.values()) > 5, before
%s
assert compiled() == before, {name: count for name, count in compiled().items() if count != before[name]}
"""

PARTS = """
from diff_encoder_sim.trials.kernels_warm_up import PARTS
for part in PARTS: part()
"""
# A trial; then a goal out of reach, with recoveries, and A*.
TRIALS = """
from lockstep_trials import BEND, ended, lockstep
from navigation_simulation import ClosedLoop, navigator_params, walled_room
ended(lockstep(BEND))
shapes, grid = walled_room()
params = navigator_params(planner_patience=0.5, NavfnROS=dict(use_dijkstra=False))
loop = ClosedLoop(shapes.with_box(1.0, 0.0, 0.1, 4.0), grid, Pose2D(-1.0, 0.0, 0.0), params=params)
for goal, status in (Pose2D(2.0, 0.0, 0.0), 'ABORTED'), (Pose2D(-2.0, 0.5, 2.0), 'SUCCEEDED'):
    loop.navigator.set_goal(goal)
    assert loop.run(60.0).status.name == status
"""
MODELS = """
from diff_encoder_sim.localization.amcl import Amcl, warm_up
from diff_encoder_sim.localization.amcl_params import AmclParams
models = [AmclParams(laser_model_type=model, do_beamskip=True, lost_fraction=0.5, max_particles=500,
                     resample_interval=1) for model in ('likelihood_field', 'likelihood_field_prob', 'beam')]
for params in models: warm_up(params)
"""
AMCL = """
from amcl_world import pillar_room, simulated_scan
for params in models:
    amcl = Amcl(params, pillar_room(), np.random.default_rng(0))
    for step in range(6):
        pose = Pose2D(0.3 * step - 1.0, 0.0, 0.1)
        amcl.update(pose, simulated_scan(amcl.grid, pose), Pose2D(0.1, 0.0, 0.2))
"""


@pytest.mark.parametrize(('warm_up', 'work'), [(PARTS, TRIALS), (MODELS, AMCL)], ids=['trials', 'amcl'])
def test_after_the_warm_up_nothing_is_left_to_compile(warm_up, work):
    command = [sys.executable, '-c', PROGRAM % (warm_up, work)]
    environment = {'PYTHONPATH': f'{SOURCE}:{SUPPORT}', 'PATH': ''}
    result = subprocess.run(command, cwd=str(SUPPORT), capture_output=True, text=True, env=environment)
    assert result.returncode == 0, result.stderr[-2000:]
