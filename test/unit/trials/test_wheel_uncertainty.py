"""Odometry's covariance follows the errors of the robot's wheels."""

import math

import numpy as np
import pytest

from diff_encoder_sim.simulation.simulator import CONTACT_CURVE_NOISE, CONTACT_DISTANCE_STD, WheelErrorParams
from diff_encoder_sim.trials.robot_params import load_robot_config, override, uncertainty_of_robot, wheel_uncertainty
from diff_encoder_sim.wheels.odometry_params import UNCERTAINTY_KEYS, USUAL_MOTION_NOISE, OdometryParams
from places import ROOT

SLIP = 'simulator.wheel_errors.slip_noise'


@pytest.fixture(name='config')
def config_fixture():
    return load_robot_config(ROOT / 'config')


def test_a_slip_that_is_simulated_is_the_motion_noise(config):
    assert override(config, {SLIP: 2.7e-8}).odometry.motion_noise == 2.7e-8


def test_ideal_wheels_leave_what_the_contact_does(config):
    odometry = override(config, {}).odometry
    expected = 0.0, CONTACT_CURVE_NOISE, CONTACT_DISTANCE_STD, 0.0, 0.0
    assert odometry.uncertainty == dict(zip(UNCERTAINTY_KEYS, expected))


def test_what_a_user_gives_stands(config):
    given = {SLIP: 2.7e-8, 'config.motion_noise': 1e-5, 'config.curve_noise': 0.0, 'config.distance_std': 0.01}
    odometry = override(config, given).odometry
    assert (odometry.motion_noise, odometry.curve_noise, odometry.distance_std) == (1e-5, 0.0, 0.01)


def test_radius_separation_and_slip_are_told_apart():
    uncertainty = wheel_uncertainty(WheelErrorParams(left_radius_error=0.01, right_radius_error=0.03))
    assert uncertainty['distance_std'] == uncertainty['turn_std'] == pytest.approx(0.02)
    assert uncertainty['diameter_difference_std'] == pytest.approx(0.02)
    uncertainty = wheel_uncertainty(WheelErrorParams(wheel_separation_error=0.01))
    assert (uncertainty['distance_std'], uncertainty['turn_std']) == (0.0, 0.01)
    uncertainty = wheel_uncertainty(WheelErrorParams(left_slip=0.1))
    assert uncertainty['diameter_difference_std'] == pytest.approx(0.1)


def test_contact_and_diameters_are_independent(config):
    errors = {f'simulator.wheel_errors.{side}_radius_error': 1e-4 for side in ('left', 'right')}
    assert override(config, errors).odometry.distance_std == pytest.approx(math.hypot(1e-4, CONTACT_DISTANCE_STD))


def test_a_robot_file_says_nothing_by_zero():
    assert uncertainty_of_robot({SLIP: 0.0, 'config.wheel_diameter': 0.2}) == {}
    assert uncertainty_of_robot({SLIP: 1e-7}) == {'motion_noise': 1e-7}


def test_a_robot_of_which_nothing_is_known_has_the_usual_noise():
    assert OdometryParams().uncertainty == dict(zip(UNCERTAINTY_KEYS, (USUAL_MOTION_NOISE, 0.0, 0.0, 0.0, 0.0)))


def test_errors_that_differ_from_robot_to_robot_spread_as_they_do():
    uncertainty = wheel_uncertainty(WheelErrorParams(radius_spread=0.01, wheel_separation_spread=0.02))
    left, right = 0.01 * np.random.default_rng(1).standard_normal((2, 4000))
    separation = 0.02 * np.random.default_rng(2).standard_normal(4000)
    mean = 0.5 * (left + right)
    assert uncertainty['distance_std'] == pytest.approx(mean.std(), rel=0.05)
    assert uncertainty['turn_std'] == pytest.approx((mean - separation).std(), rel=0.05)
    assert uncertainty['diameter_difference_std'] == pytest.approx((right - left).std(), rel=0.05)
