"""Draws of one drive and of one robot."""

import math

import numpy as np
import pytest

from diff_encoder_sim.advice.drive_draws import (
    ALL_CAUSES,
    CALIBRATED_GEOMETRY,
    CONTACT,
    RADIUS,
    SLIP,
    DriveDraws,
    drawn_robot,
    navigated,
    recorded,
    scripted,
)
from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.per_wheel import WheelDiameter
from diff_encoder_sim.base.se2 import Pose2D, poses_of_wheels
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.navigation.goal_stopping import StopSpread
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.simulated_robot import TrueWheels
from diff_encoder_sim.robots.wheel_quality import EXACT, WheelQuality
from diff_encoder_sim.simulation.slip import WheelErrorParams
from diff_encoder_sim.trials.robot_params import load_robot_config, override
from drawn_drives import LINE_M, calibrated, encoder_of, line, one_by_one, robot_of, rolled
from encoder_drives import RADIUS_M, SEPARATION_M
from lockstep_trials import ALTO, HALL, params_of, plan_of
from places import ROOT

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
SOURCE = RobotSource(ALTO)
NEAR = {**HALL, 'name': 'near', 'route': [{'goal': {'x': -2.4, 'y': 0.0}}]}
WRONG_WHEELS = WheelErrorParams(left_radius_error=0.01, slip_noise=1e-4, left_slip=0.01)


def errors_of(drive, robot, encoder, draws=DRAWS, seed=1, **amounts):
    """(draws, 3) final errors."""
    return DriveDraws(drive, robot, seed).errors([encoder], draws, **amounts)[0]


@pytest.mark.parametrize(
    ('drive', 'encoder', 'errors'),
    [
        (line(2.0), {'edge_error': 0.2, 'eccentricity': 0.01}, {'slip_noise': 2e-6, 'radius_spread': 0.001}),
        (rolled(*ROUTE, start={'x': 1.0, 'yaw': 2.0}), {'faults': {'missed': 0.002}}, ALL_ERRORS),
        (rolled(*ROUTE), {'hysteresis': 2.0}, {'stop': StopSpread(0.05, 0.1), 'right_slip': 0.002}),
    ],
    ids=['sensor', 'all of the wheels', 'stop'],
)
def test_draws_are_as_one_by_one(drive, encoder, errors):
    robot, encoder = robot_of(**errors), encoder_of(90, encoder)
    alone = np.array([one_by_one(drive, robot, encoder, seed) for seed in range(120)])
    drawn = errors_of(drive, robot, encoder)
    standard_error = alone.std(axis=0) / math.sqrt(len(alone))
    assert np.all(np.abs(alone.mean(axis=0) - drawn.mean(axis=0)) < 4.0 * standard_error + 1e-6)
    assert alone.std(axis=0) == pytest.approx(drawn.std(axis=0), rel=0.3, abs=1e-6)


def test_causes_are_left_out():
    errors = errors_of(line(), robot_of(**ALL_ERRORS), None, 20, amounts={})
    np.testing.assert_allclose(errors, 0.0, atol=1e-9)
    of_half = errors_of(line(), robot_of(left_radius_error=1e-4), None, 1, amounts={RADIUS: 0.5})
    assert of_half[0, 2] == pytest.approx(0.5 * LINE_M * 1e-4 / SEPARATION_M, rel=1e-3)


@pytest.mark.parametrize(
    ('drive', 'known', 'stds'),
    [
        (line(), {'scale': 0.002}, (0.002 * LINE_M, 0.0, 0.0)),
        (line(), {'ratio': 1e-4}, (None, 1e-4 * LINE_M**2 / (2.0 * SEPARATION_M), 1e-4 * LINE_M / SEPARATION_M)),
        (rolled(('turns', 2.0)), {'turning': 0.001}, (0.0, 0.0, 0.004 * math.pi)),
        (line(), {'slip_m2_per_m': 1e-7}, (None, None, math.sqrt(2e-7 * LINE_M) / SEPARATION_M)),
        (rolled(('turns', 2.0)), {'slip_rad2_per_rad': 1e-6}, (0.0, 0.0, math.sqrt(4e-6 * math.pi))),
        (rolled(('turns', 2.0)), {'scale': 0.001, 'ratio': 1e-4}, (None, None, 0.0)),
    ],
    ids=['scale', 'ratio', 'turning', 'slip', 'slip in turns', 'turns do not need the others'],
)
def test_what_a_calibration_leaves_open_is_its_closed_form(drive, known, stds):
    errors = errors_of(drive, robot_of(calibration=calibrated(**known)), None)
    for found, expected in zip(errors.std(axis=0), stds):
        assert expected is None or found == pytest.approx(expected, rel=0.05, abs=2e-6)
    assert errors_of(drive, robot_of(calibration=calibrated()), None, 5) == pytest.approx(0.0, abs=1e-12)


def test_parts_of_a_calibration_are_switched_on_one_by_one():
    robot = robot_of(calibration=calibrated(scale=0.002, turning=0.001))
    draws = DriveDraws(line(), robot, 1)
    scale, ratio, turning = CALIBRATED_GEOMETRY
    assert draws.causes == [scale, turning, CONTACT]
    together, alone = draws.errors([None], 50)[0], draws.errors([None], 50, {scale: 1.0})[0]
    np.testing.assert_allclose(alone, together, atol=1e-9)  # a line needs no separation
    assert not draws.errors([None], 50, {ratio: 1.0, turning: 1.0})[0].round(9).any()


def test_a_recorded_drive_is_true_by_the_robots_geometry():
    bent = rolled(*ROUTE)
    angles_rad = 3.0 + bent.rolled.ways_m / robot_of().assumed[:2]
    drive = recorded('bent', Drive((1e9 * bent.rolled.times_s).astype(np.int64), angles_rad), robot_of())
    assert drive.goal_in_map == pytest.approx(bent.goal_in_map, abs=1e-6)
    assert drive.wheel_way_m == pytest.approx(bent.wheel_way_m)
    of_recorded, of_rolled = (errors_of(each, robot_of(), encoder_of(PPR), seed=2) for each in (drive, bent))
    assert of_recorded.std(axis=0) == pytest.approx(of_rolled.std(axis=0), rel=0.1)
    assert CONTACT not in DriveDraws(drive, robot_of(), 1).causes


def test_wheels_that_stand_still_are_no_drive():
    with pytest.raises(ConfigError, match='--drive: still: the wheels do not turn'):
        recorded('still', Drive(np.arange(3), np.ones((3, 2))), robot_of())


def test_what_simulated_contacts_slip_is_left_out_unless_it_is_asked_for():
    drive = line()
    drive = drive._replace(rolled=drive.rolled._replace(end=Pose2D(LINE_M - 0.002, 0.001, 0.0003)))
    assert errors_of(drive, robot_of(), None, 1)[0] == pytest.approx(np.zeros(3), abs=1e-12)
    with_contact = errors_of(drive, robot_of(), None, 1, amounts=ALL_CAUSES)[0]
    assert with_contact == pytest.approx([0.002, -0.001, -0.0003])


def test_unequal_wheels_are_an_error_only_if_odometry_does_not_know_them():
    robot, wheels = robot_of(), WheelDiameter(left=2.02 * RADIUS_M, right=1.98 * RADIUS_M)
    robot = robot._replace(sound=TrueWheels(*wheels.radii_m, SEPARATION_M))
    assert errors_of(line(), robot, None, 1)[0, 2] == pytest.approx(LINE_M * 0.02 / SEPARATION_M, rel=1e-3)
    known = robot._replace(odometry=robot.odometry.model_copy(update={'wheel_diameter': wheels}))
    assert errors_of(line(), known, None, 1)[0] == pytest.approx(np.zeros(3), abs=1e-9)
    assert errors_of(line(), known, encoder_of(1e6), 1)[0] == pytest.approx(np.zeros(3), abs=1e-3)
    assert (robot.has(RADIUS), known.has(RADIUS)) == (True, False)


def test_the_axle_ahead_of_the_base_swings_in_turns():
    robot = robot_of(wheel_separation_error=0.01)
    robot = robot._replace(odometry=robot.odometry.model_copy(update={'axle_x': 0.3}), axle_x_m=0.3)
    errors, turned = errors_of(rolled(('turns', 0.25)), robot, None, 1)[0], 0.5 * math.pi * 1.01
    assert errors[:2] == pytest.approx([0.3 * (1.0 - math.cos(turned)) - 0.3, 0.3 - 0.3 * math.sin(turned)], abs=1e-9)


def test_slip_by_lateral_acceleration_turns_odometry_in_circles_and_not_in_place():
    """By 2 k v^2 / L of the turn."""
    robot = robot_of(slip={'lateral_acceleration': 0.01})
    circles = rolled(('arc', {'radius': 1.0, 'turns': 3.0}), speed=0.5, acceleration=2.0)
    draws = DriveDraws(circles, robot, 1)
    assert draws.causes == [SLIP, CONTACT]
    _, _, yaw_rad = draws.errors([None], 1)[0][0]
    turning_rad = 2.0 * 0.01 * 0.5**2 / SEPARATION_M * 6.0 * math.pi
    assert yaw_rad == pytest.approx(turning_rad, rel=0.03)  # less on the ramps
    in_place = DriveDraws(rolled(('turns', 3.0)), robot, 1).errors([None], 1)[0][0]
    np.testing.assert_allclose(in_place, 0.0, atol=1e-9)


def test_the_same_draws_come_with_every_encoder_and_number_of_encoders():
    draws = DriveDraws(line(4.0), robot_of(slip_noise=1e-6), 3)
    together = draws.errors([encoder_of(90), encoder_of(1024), None], 50)
    np.testing.assert_array_equal(together[1], draws.errors([encoder_of(1024)], 50)[0])
    np.testing.assert_allclose(together[1], together[2], atol=0.02)


def test_wheels_of_a_quality_share_the_errors_of_encoders():
    """Their errors are added to those of exact wheels: as if both were sampled at once."""
    robot, encoders = robot_of(slip_noise=1e-7, left_radius_error=0.2), [encoder_of(360), None]
    good, drive = robot.with_quality(WheelQuality('good', '', 2e-4, '')), line(8.0, speed=2.0)
    exact, own = DriveDraws(drive, robot.with_quality(EXACT), 1), DriveDraws(drive, good, 2)
    shared = exact.of(good, exact)
    for added, at_once, of_exact in zip(*(each.errors(encoders, DRAWS) for each in (shared, own, exact))):
        assert added.std(axis=0) == pytest.approx(at_once.std(axis=0), rel=0.06)
        assert added[:, 1].std() > 1.2 * of_exact[:, 1].std()
    assert (exact.robot.has(RADIUS), shared.robot.has(RADIUS), shared.robot.has(SLIP)) == (False, True, True)


def test_errors_under_way_end_as_at_the_goal():
    draws = DriveDraws(rolled(*ROUTE, start={'yaw': 1.0}), robot_of(left_radius_error=0.01), 1)
    under_way = draws.errors_under_way(5)
    np.testing.assert_allclose(under_way[:, -1], draws.errors([None], 5)[0], atol=1e-9)
    assert not under_way[:, 0].any()
    assert draws.travel(-1) == pytest.approx((1.8, 2.0 * math.pi * 0.35), rel=1e-3)


def test_a_robot_is_read_from_its_files():
    params = override(load_robot_config(ROOT / 'config'), {})
    robot = drawn_robot(SOURCE, params)
    assert tuple(robot.sound) == pytest.approx((0.1, 0.1, 0.4))
    assert (robot.errors, robot.odometry, robot.axle_x_m) == (params.simulator.wheel_errors, params.odometry, 0.0)
    assert 0.0 < robot.stop.position_m <= params.navigator.DWAPlannerROS.xy_goal_tolerance


@pytest.fixture(scope='module')
def bent():
    """A scripted drive; errors of the robot's wheels are left to the draws."""
    params = override(load_robot_config(ROOT / 'config'), {})
    simulator = params.simulator.model_copy(update={'wheel_errors': WRONG_WHEELS})
    start, segments = {'x': 1.0, 'yaw': 1.0}, [{'straight': 0.5}, {'turns': 0.3}]
    test = TestDefinition.from_mapping({'name': 'bent', 'world': 'hallway', 'start': start, 'drive': segments}, '')
    return scripted(test, SOURCE, params._replace(simulator=simulator))


def test_a_script_is_driven_to_its_end(bent):
    assert tuple(bent.rolled.end) == pytest.approx((0.5, 0.0, 0.6 * math.pi), abs=2e-3)
    assert bent.wheel_way_m == pytest.approx(0.5 + 0.2 * 0.6 * math.pi, abs=2e-3)
    assert (bent.test, bent.goal_in_map.x_m) == ('bent', 1.0 + 0.5 * math.cos(1.0))


def test_a_route_is_navigated_with_sound_wheels_and_a_fine_encoder():
    params = params_of()
    simulator = params.simulator.model_copy(update={'wheel_errors': WRONG_WHEELS})
    drive = navigated(plan_of(NEAR, ppr=4), SOURCE, params._replace(simulator=simulator))
    end = drive.requested.test.start.pose().compose(drive.rolled.end).relative_to(drive.goal_in_map)
    assert math.hypot(end.x_m, end.y_m) < 0.15
    ways_m, separation_m = drive.rolled.ways_m[np.newaxis], drive.rolled.separation_m
    of_wheels = poses_of_wheels(ways_m, 1.0, 1.0, separation_m, 0.0, True)[0, 0]
    assert of_wheels == pytest.approx(np.array(drive.rolled.end), abs=5e-3)


def test_a_goal_that_is_not_reached_is_told():
    with pytest.raises(ConfigError, match=r'^near: the robot does not come to its goal: '):
        navigated(plan_of(NEAR, time_limit=0.5), SOURCE, params_of())
