"""Short trials in lockstep for tests, and what they end with."""

import math
from pathlib import Path

import numpy as np

from diff_encoder_sim.drives.test_definition import TestDefinition, find_world, load_test
from diff_encoder_sim.drives.trial_definition import Trial, TrialPlan
from diff_encoder_sim.trials.campaign_cells import LockstepOptions, TrialSetup
from diff_encoder_sim.trials.lockstep_trial import LockstepTrial
from diff_encoder_sim.trials.robot_params import LatencyParams, load_robot_config, override
from diff_encoder_sim.trials.trial_run import run_trials
from places import ROOT

ALTO = ROOT / 'urdf' / 'alto.urdf.xacro'
# 3 m and a turn of 40 degrees in the hallway; a turn and a bend between the pillars.
HALL = {'name': 'hall', 'world': 'hallway', 'start': {'x': -3.0}, 'route': [{'goal': {'x': 0.0, 'y': 0.0, 'yaw': 0.7}}]}
BEND = {
    'name': 'bend',
    'world': 'ros_logo',
    'start': {'x': -3.4, 'y': -0.85},
    'route': [{'turns': 0.5}, {'through': [{'x': -1.9, 'y': -0.935}]}, {'goal': {'x': 0.0, 'y': -0.935}}],
}


def plan_of(test, ppr=90, number=1, map_file=None, nav='embedded', bag='', **changes):
    """Of a definition, or of its file."""
    is_file = isinstance(test, Path)
    test = load_test(str(test), ROOT / 'config') if is_file else TestDefinition.from_mapping({**test, **changes}, '')
    world = find_world(test.world, ROOT / 'worlds')
    return TrialPlan(
        trial=Trial(test=test, ppr=ppr, number=number, nav=nav),
        world=str(world),
        map=str(map_file or world.with_suffix('.yaml')),
        bag=str(bag),
    )


def params_of(latency=LatencyParams(), encoder_rate=20.0, **navigation):
    params = override(load_robot_config(ROOT / 'config'), {})
    return params._replace(
        latency=latency,
        encoder=params.encoder.model_copy(update={'rate': encoder_rate}),
        navigator=params.navigator.model_copy(update=navigation),
    )


def lockstep(test, ppr=90, *, latency=LatencyParams(), publications=None, encoder_rate=20.0, frequency=20.0, **plan):
    params = params_of(latency, encoder_rate, controller_frequency=frequency)
    return LockstepTrial(plan_of(test, ppr, **plan), ALTO, params, publications)


def run_trial(plan, robot_file, params, record):
    """The row of one trial, whose bag is written unless `record` is none."""
    return run_trials([TrialSetup(plan, params, LockstepOptions(record=record))], robot_file)[0]


def ended(trial):
    """How a trial ends, after it was run."""
    for _ in trial.run():
        pass
    return trial.ending


def distance_and_turn(pose, goal):
    error = pose.relative_to(goal.pose())
    return math.hypot(error.x_m, error.y_m), abs(error.yaw_rad)


def goal_of(test):
    return TestDefinition.from_mapping(test, '').route[-1].goal


def blind(scan):
    return scan._replace(ranges_m=np.full_like(scan.ranges_m, np.inf))
