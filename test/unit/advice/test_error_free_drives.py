"""One drive of each test: by its script, or navigated."""

import math

import numpy as np
import pytest

from diff_encoder_sim.advice.error_free_drives import navigated, scripted, straight_test
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.simulation.simulator import WheelErrorParams
from diff_encoder_sim.trials.robot_params import load_robot_params
from diff_encoder_sim.wheels.drawn_counts import final_poses
from lockstep_trials import ALTO, HALL, params_of, plan_of
from places import ROOT

SOURCE = RobotSource(ALTO)
BENT = {
    'name': 'bent',
    'world': 'hallway',
    'start': {'x': 1.0, 'yaw': 1.0},
    'drive': [{'straight': 0.5}, {'turns': 0.3}],
}
NEAR = {**HALL, 'name': 'near', 'route': [{'goal': {'x': -2.4, 'y': 0.0}}]}
WRONG_WHEELS = WheelErrorParams(left_radius_error=0.01, slip_noise=1e-4, left_slip=0.01)


def of_wheels(rolled_drive):
    left_m, right_m = rolled_drive.ways_m.T[:, np.newaxis]
    return final_poses(left_m, right_m, rolled_drive.separation_m)[0]


@pytest.fixture(scope='module')
def bent():
    return scripted(TestDefinition.from_mapping(BENT, ''), SOURCE, load_robot_params(ROOT / 'config'))


def test_a_script_is_driven_to_its_end(bent):
    assert tuple(bent.rolled.end) == pytest.approx((0.5, 0.0, 0.6 * math.pi), abs=2e-3)
    assert bent.wheel_way_m == pytest.approx(0.5 + 0.2 * 0.6 * math.pi, abs=2e-3)
    assert (bent.test, bent.start_in_map, bent.goal_in_map.x_m) == ('bent', (1.0, 0.0, 1.0), 1.0 + 0.5 * math.cos(1.0))


def test_the_errors_of_wheels_are_left_to_the_draws():
    params = load_robot_params(ROOT / 'config')
    simulator = params.simulator.model_copy(update={'wheel_errors': WRONG_WHEELS})
    drive = scripted(TestDefinition.from_mapping(BENT, ''), SOURCE, params._replace(simulator=simulator))
    assert tuple(drive.rolled.end) == pytest.approx((0.5, 0.0, 0.6 * math.pi), abs=2e-3)


def test_a_straight_line_takes_the_speeds_of_the_test():
    like = TestDefinition.from_mapping({**BENT, 'limits': {'speed': 0.2}, 'route': HALL['route']}, '')
    straight = straight_test(7.5, like)
    assert straight.name == '7.5 m straight'
    assert (straight.limits.speed, straight.route) == (0.2, [])
    assert tuple(straight.drive_end().relative_to(straight.start.pose())) == pytest.approx((7.5, 0.0, 0.0))


def test_a_route_is_navigated_with_sound_wheels_and_a_fine_encoder():
    params = params_of()
    simulator = params.simulator.model_copy(update={'wheel_errors': WRONG_WHEELS})
    drive = navigated(plan_of(NEAR, ppr=4), SOURCE, params._replace(simulator=simulator))
    end = drive.start_in_map.compose(drive.rolled.end).relative_to(drive.goal_in_map)
    assert math.hypot(end.x_m, end.y_m) < 0.15
    assert of_wheels(drive.rolled) == pytest.approx(np.array(drive.rolled.end), abs=5e-3)


def test_a_goal_that_is_not_reached_is_told():
    with pytest.raises(ConfigError, match=r'^near: the robot does not come to its goal: '):
        navigated(plan_of(NEAR, time_limit=0.5), SOURCE, params_of())
