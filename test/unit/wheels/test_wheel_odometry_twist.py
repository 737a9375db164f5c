"""The twist by counts, by measured speeds, and through a low-pass; the pose is by counts in any case."""

import pytest

from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams

PERIOD_NS, PERIOD_S = 50_000_000, 0.05
DIAMETER_M, SEPARATION_M, PPR = 0.2, 0.4, 40


def odometry(**params):
    return WheelOdometry(OdometryParams(ppr=PPR, **params))


def twists(wheel_odometry, reports):
    """(linear, angular) after each report: counts and, where there are three values, measured speeds."""
    estimates = [wheel_odometry.update(index * PERIOD_NS, *report) for index, report in enumerate(reports)]
    return [(estimate.linear_velocity_mps, estimate.angular_velocity_radps) for estimate in estimates]


def test_measured_speeds_make_the_twist_and_leave_the_pose():
    by_counts, by_speeds = odometry(), odometry()
    for index in range(20):
        counts = index // 3, index // 4
        pose = by_counts.update(index * PERIOD_NS, *counts).base_pose_in_odom
        estimate = by_speeds.update(index * PERIOD_NS, *counts, (2.0, 3.0))
        assert estimate.base_pose_in_odom == pose
        assert estimate.linear_velocity_mps == pytest.approx(0.5 * DIAMETER_M * 2.5)
        assert estimate.angular_velocity_radps == pytest.approx(0.5 * DIAMETER_M * 1.0 / SEPARATION_M)


@pytest.mark.parametrize('time_constant_s', [0.02, 0.1, 1.0])
def test_a_step_passes_the_low_pass_as_the_first_order_difference_equation_has_it(time_constant_s):
    reports = [(0, 0, (0.0, 0.0))] + [(0, 0, (4.0, -2.0))] * 30
    seen = twists(odometry(velocity_low_pass=time_constant_s), reports)
    for index, (linear_mps, angular_radps) in enumerate(seen):
        share = 1.0 - (time_constant_s / (time_constant_s + PERIOD_S)) ** index
        assert linear_mps == pytest.approx(0.5 * DIAMETER_M * 1.0 * share, abs=1e-12)
        assert angular_radps == pytest.approx(0.5 * DIAMETER_M * -6.0 / SEPARATION_M * share, abs=1e-12)


@pytest.mark.parametrize('measured', [(), ((0.0, 0.0),)])
def test_at_standstill_the_low_pass_decays_to_zero(measured):
    wheel_odometry = odometry(velocity_low_pass=0.1)
    driving = [(index, index, *([(3.14, 3.14)] if measured else [])) for index in range(20)]
    linear_mps, angular_radps = twists(wheel_odometry, driving + [(19, 19, *measured)] * 60)[-1]
    assert (linear_mps, angular_radps) == pytest.approx((0.0, 0.0), abs=1e-6)
