"""What of a robot its odometry depends on."""

import numpy as np
import pytest

from diff_encoder_sim.advice.drawn_robot import ALL_CAUSES, ROBOTS_CAUSES, WheelCause, drawn_robot
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.simulation.simulator import WheelErrorParams
from diff_encoder_sim.trials.robot_params import load_robot_params
from drawn_drives import robot_of
from encoder_drives import RADIUS_M, SEPARATION_M
from lockstep_trials import ALTO
from places import ROOT

DRAWS = 20_000


def wheels_of(amounts=ALL_CAUSES, **errors):
    return robot_of(**errors).wheels(amounts, np.random.default_rng(1), DRAWS)


def test_a_robot_is_read_from_its_files():
    params = load_robot_params(ROOT / 'config')
    robot = drawn_robot(RobotSource(ALTO), params)
    assert tuple(robot.sound) == pytest.approx((0.1, 0.1, 0.4))
    assert (robot.errors, robot.odometry, robot.axle_x_m) == (params.simulator.wheel_errors, params.odometry, 0.0)
    assert 0.0 < robot.stop.position_m <= params.navigator.DWAPlannerROS.xy_goal_tolerance


def test_wheels_have_the_errors_of_every_robot():
    wheels = wheels_of(left_radius_error=0.01, wheel_separation_error=-0.02)
    assert wheels.left_radius_m == pytest.approx(np.full((DRAWS, 1), 1.01 * RADIUS_M))
    assert wheels.right_radius_m == pytest.approx(np.full((DRAWS, 1), RADIUS_M))
    assert wheels.separation_m == pytest.approx(np.full((DRAWS, 1), 0.98 * SEPARATION_M))


def test_wheels_differ_from_robot_to_robot_as_those_of_trials():
    errors = {'left_radius_error': 0.01, 'radius_spread': 0.002, 'wheel_separation_spread': 0.005}
    rng = np.random.default_rng(2)
    of_trials = np.array([WheelErrorParams(**errors).geometry(rng) for _ in range(DRAWS)])
    nominal = np.array([RADIUS_M, RADIUS_M, SEPARATION_M])
    drawn = np.hstack(wheels_of(**errors)) / nominal - 1.0
    assert drawn.mean(axis=0) == pytest.approx(of_trials.mean(axis=0), abs=2e-4)
    assert drawn.std(axis=0) == pytest.approx(of_trials.std(axis=0), rel=0.03)


@pytest.mark.parametrize(
    ('errors', 'causes'),
    [
        ({}, []),
        ({'right_radius_error': 0.001}, [WheelCause.RADIUS]),
        ({'radius_spread': 0.001}, [WheelCause.RADIUS]),
        ({'wheel_separation_error': 0.001}, [WheelCause.SEPARATION]),
        ({'wheel_separation_spread': 0.001}, [WheelCause.SEPARATION]),
        ({'left_slip': 0.001}, [WheelCause.SLIP]),
        ({'slip_noise': 1e-6}, [WheelCause.SLIP]),
    ],
)
def test_errors_have_their_cause(errors, causes):
    assert [cause for cause in ROBOTS_CAUSES if robot_of(**errors).has(cause)] == causes
