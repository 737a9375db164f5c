"""The whole robot in lockstep on short routes: it arrives, and equal seeds give equal bits."""
import math
from pathlib import Path

import numpy as np
import pytest

from diff_encoder_sim.experiments.definition import TestDefinition, Trial, TrialPlan, find_world
from diff_encoder_sim.experiments.lockstep import LockstepTrial
from diff_encoder_sim.experiments.robot_params import load_robot_params
from diff_encoder_sim.experiments.route_driver import RouteFailed
from diff_encoder_sim.mapping.map_files import save_map
from diff_encoder_sim.mapping.rasterise import rasterise
from diff_encoder_sim.simulation.world import load_world

ROOT = Path(__file__).resolve().parents[2]
SCAN_HEIGHT_M = 0.3
# 3 m and a turn of 40 degrees in the hallway; a turn and a bend between the pillars.
HALL = {'name': 'hall', 'world': 'hallway', 'start': {'x': -3.0},
        'route': [{'goal': {'x': 0.0, 'y': 0.0, 'yaw': 0.7}}]}
BEND = {'name': 'bend', 'world': 'ros_logo', 'start': {'x': -3.4, 'y': -0.85},
        'route': [{'turns': 0.5}, {'through': [{'x': -1.9, 'y': -0.935}]},
                  {'goal': {'x': 0.0, 'y': -0.935}}]}


def lockstep(test, ppr=90, number=1, map_file=None, **changes):
    test = TestDefinition.from_mapping({**test, **changes}, '')
    world = find_world(test.world, ROOT / 'worlds')
    plan = TrialPlan(trial=Trial(test=test, ppr={'left': ppr, 'right': ppr}, number=number,
                                 nav='embedded'),
                     world=str(world), map=str(map_file or world.with_suffix('.yaml')), bag='')
    return LockstepTrial(plan, ROOT / 'urdf' / 'alto.urdf.xacro', load_robot_params(ROOT / 'config'))


def distance_and_turn(pose, goal):
    error = pose.relative_to(goal.pose())
    return math.hypot(error.x_m, error.y_m), abs(error.yaw_rad)


@pytest.mark.parametrize('test', [HALL, BEND], ids=['hall', 'bend'])
@pytest.mark.parametrize('ppr', [40, 4096])
def test_it_ends_at_its_goal_within_tolerance_by_its_belief(test, ppr):
    *_, last = lockstep(test, ppr).run()
    goal = TestDefinition.from_mapping(test, '').route[-1].goal
    # Table 2: 0.05 m, latched while it turns; 0.052 rad.
    distance_m, turn_rad = distance_and_turn(last.believed_pose_in_map, goal)
    assert distance_m < 0.06
    assert turn_rad < 0.052
    distance_m, turn_rad = distance_and_turn(last.true_pose_in_map, goal)
    assert distance_m < 0.25
    assert turn_rad < 0.2


def test_a_map_of_another_resolution_will_do(tmp_path):
    coarse = rasterise(load_world(ROOT / 'worlds' / 'hallway.world'), SCAN_HEIGHT_M, 0.1, 0.0, 0.0)
    *_, last = lockstep(HALL, map_file=save_map(coarse, tmp_path / 'coarse')).run()
    goal = TestDefinition.from_mapping(HALL, '').route[-1].goal
    assert distance_and_turn(last.believed_pose_in_map, goal)[0] < 0.06
    assert distance_and_turn(last.true_pose_in_map, goal)[0] < 0.25


def test_reports_come_at_twenty_hertz_and_belief_follows_truth():
    reports = list(lockstep(HALL, 1024).run())
    assert set(np.diff([report.stamp_ns for report in reports])) == {50_000_000}
    assert reports[0].believed_pose_in_map is None
    errors = [report.believed_pose_in_map.relative_to(report.true_pose_in_map)
              for report in reports[20:]]
    assert max(math.hypot(error.x_m, error.y_m) for error in errors) < 0.3


def test_the_same_trial_is_the_same_bit_for_bit_and_another_is_not():
    first, second, other = ([(report.true_pose_in_map, report.odometry.base_pose_in_odom,
                              report.believed_pose_in_map, report.navigation.command)
                             for report in lockstep(BEND, number=number).run()]
                            for number in (5, 5, 6))
    assert first == second
    assert first != other


def test_a_goal_in_a_wall_fails_with_the_reason():
    with pytest.raises(RouteFailed, match='the goal was not reached'):
        list(lockstep(HALL, route=[{'goal': {'x': -3.0, 'y': 3.1}}]).run())


def test_a_trial_that_takes_too_long_fails():
    with pytest.raises(RouteFailed, match='time_limit'):
        list(lockstep(HALL, time_limit=2.0).run())
