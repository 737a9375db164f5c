"""The motor controller: limits, ramps, timeout, kinematics."""

import math

import pytest

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.simulation.simulator import DriveController, DriveParams

SECOND = 1_000_000_000


def controller(**params):
    return DriveController(DriveParams(**params), wheel_radius_m=0.1, wheel_separation_m=0.4)


def settled(drive, linear, angular):
    """Wheel speeds after the ramps."""
    for tick in range(200):
        now = tick * SECOND // 100
        drive.command(now, linear, angular)
        speeds = drive.wheel_speeds_radps(now, 0.01)
    return speeds


@pytest.mark.parametrize(
    ('linear', 'angular', 'speeds'),
    [(0.45, 0.0, (4.5, 4.5)), (-0.45, 0.0, (-4.5, -4.5)), (0.0, 1.0, (-2.0, 2.0)), (0.3, -0.5, (4.0, 2.0))],
)
def test_commands_become_wheel_speeds(linear, angular, speeds):
    assert settled(controller(), linear, angular) == pytest.approx(speeds)


def test_the_ramp_keeps_the_acceleration_limit():
    drive = controller(max_linear_acceleration=0.5)
    drive.command(0, 1.0, 0.0)
    speeds = [drive.wheel_speeds_radps(0, 0.01)[0] * 0.1 for _ in range(3)]
    assert speeds == pytest.approx([0.005, 0.010, 0.015])


def test_what_is_beyond_the_limits_is_cut_with_a_warning(caplog):
    assert settled(controller(max_linear_speed=0.5), 99.0, 0.0) == pytest.approx((5.0, 5.0))
    assert 'exceeds the limits' in caplog.text


@pytest.mark.parametrize('command', [(math.nan, 0.0), (0.0, math.inf), (-math.inf, math.nan)])
def test_a_command_that_is_not_finite_is_refused_and_the_last_one_stays(command):
    drive = controller()
    settled(drive, 0.4, 0.0)
    with pytest.raises(InputFault, match='finite'):
        drive.command(2 * SECOND, *command)
    assert drive.wheel_speeds_radps(2 * SECOND, 0.01) == pytest.approx((4.0, 4.0))


def test_without_commands_the_robot_stops():
    drive = controller(command_timeout=0.5)
    settled(drive, 0.4, 0.5)
    last = 199 * SECOND // 100
    assert drive.wheel_speeds_radps(last + SECOND // 2, 0.01) == pytest.approx((3.0, 5.0))
    for tick in range(51, 200):
        speeds = drive.wheel_speeds_radps(last + tick * SECOND // 100, 0.01)
    assert speeds == (0.0, 0.0)
