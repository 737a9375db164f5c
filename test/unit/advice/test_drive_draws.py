"""Draws of one drive: as the components that nodes run, and as closed forms say."""

import math

import numpy as np
import pytest

from diff_encoder_sim.advice.drawn_robot import ALL_CAUSES, WheelCause
from diff_encoder_sim.advice.drive_draws import DriveDraws
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.navigation.goal_stopping import StopSpread
from drawn_drives import LINE_M, encoder_of, line, many_one_by_one, robot_of, rolled
from encoder_drives import SEPARATION_M

PPR, DRAWS = 360, 2000
ROUTE = (('straight', 1.0), ('turns', 0.25), ('straight', -0.8), ('turns', -0.1))
ALL_ERRORS = {
    'left_radius_error': 0.002,
    'wheel_separation_error': -0.01,
    'radius_spread': 0.001,
    'wheel_separation_spread': 0.003,
    'left_slip': 0.003,
    'slip_noise': 2e-6,
}


def errors_of(drive, robot, encoder, draws=DRAWS, seed=1, **amounts):
    """(draws, 3) final errors."""
    return DriveDraws(drive, robot, seed).errors([encoder], draws, **amounts)[0]


@pytest.mark.parametrize(
    ('drive', 'encoder', 'errors'),
    [
        (line(2.0), {}, {}),
        (line(2.0), {'edge_error': 0.2, 'eccentricity': 0.01}, {'slip_noise': 2e-6, 'radius_spread': 0.001}),
        (rolled(*ROUTE, start={'x': 1.0, 'yaw': 2.0}), {'faults': {'missed': 0.002}}, ALL_ERRORS),
        (rolled(*ROUTE), {'hysteresis': 2.0}, {'stop': StopSpread(0.05, 0.1), 'right_slip': 0.002}),
    ],
    ids=['ideal', 'sensor', 'all of the wheels', 'stop'],
)
def test_draws_are_as_one_by_one(drive, encoder, errors):
    robot, encoder = robot_of(**errors), encoder_of(90, encoder)
    alone, drawn = many_one_by_one(drive, robot, encoder, range(60)), errors_of(drive, robot, encoder)
    standard_error = alone.std(axis=0) / math.sqrt(len(alone))
    assert np.all(np.abs(alone.mean(axis=0) - drawn.mean(axis=0)) < 4.0 * standard_error + 1e-6)
    assert alone.std(axis=0) == pytest.approx(drawn.std(axis=0), rel=0.3, abs=1e-6)


def test_causes_are_left_out():
    errors = errors_of(line(), robot_of(**ALL_ERRORS), None, 20, amounts={})
    np.testing.assert_allclose(errors, 0.0, atol=1e-9)
    of_half = errors_of(line(), robot_of(left_radius_error=1e-4), None, 1, amounts={WheelCause.RADIUS: 0.5})
    assert of_half[0, 2] == pytest.approx(0.5 * LINE_M * 1e-4 / SEPARATION_M, rel=1e-3)


def test_errors_are_in_the_axes_of_the_map():
    ahead = errors_of(line(), robot_of(right_radius_error=1e-3), None, 1)[0]
    to_the_left = errors_of(
        rolled(('straight', LINE_M), start={'yaw': 0.5 * math.pi}), robot_of(right_radius_error=1e-3), None, 1
    )[0]
    assert to_the_left == pytest.approx([-ahead[1], ahead[0], ahead[2]])


def test_what_simulated_contacts_slip_is_left_out_unless_it_is_asked_for():
    drive = line()
    drive = drive._replace(rolled=drive.rolled._replace(end=Pose2D(LINE_M - 0.002, 0.001, 0.0003)))
    assert errors_of(drive, robot_of(), None, 1)[0] == pytest.approx(np.zeros(3), abs=1e-12)
    with_contact = errors_of(drive, robot_of(), None, 1, amounts=ALL_CAUSES)[0]
    assert with_contact == pytest.approx([0.002, -0.001, -0.0003])


def test_the_axle_ahead_of_the_base_swings_in_turns():
    quarter = rolled(('turns', 0.25))
    robot = robot_of(wheel_separation_error=0.01)
    odometry = robot.odometry.model_copy(update={'axle_x': 0.3})
    errors = errors_of(quarter, robot._replace(odometry=odometry, axle_x_m=0.3), None, 1)[0]
    turned = 0.5 * math.pi * 1.01
    assert errors[0] == pytest.approx(0.3 * (1.0 - math.cos(turned)) - 0.3, abs=1e-9)
    assert errors[1] == pytest.approx(0.3 - 0.3 * math.sin(turned), abs=1e-9)


def test_the_same_draws_come_with_every_encoder_and_number_of_encoders():
    draws = DriveDraws(line(4.0), robot_of(slip_noise=1e-6), 3)
    together = draws.errors([encoder_of(90), encoder_of(1024), None], 50)
    np.testing.assert_array_equal(together[1], draws.errors([encoder_of(1024)], 50)[0])
    np.testing.assert_allclose(together[1], together[2], atol=0.02)
