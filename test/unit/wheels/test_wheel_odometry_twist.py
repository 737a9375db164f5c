"""The twist by counts, by measured speeds, and through a low-pass; the pose is by counts in any case."""

import math

import pytest

from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams

PERIOD_NS, PERIOD_S = 50_000_000, 0.05
DIAMETER_M, SEPARATION_M, PPR = 0.2, 0.4, 40
D_M = math.pi * DIAMETER_M / PPR


def odometry(**params):
    return WheelOdometry(OdometryParams(ppr=PPR, **params))


def twists(wheel_odometry, reports):
    """(linear, angular) after each report: counts and, where there are three values, measured speeds."""
    estimates = [wheel_odometry.update(index * PERIOD_NS, *report) for index, report in enumerate(reports)]
    return [(estimate.linear_velocity_mps, estimate.angular_velocity_radps) for estimate in estimates]


def test_ms_quantum_is_a_count_per_period():
    seen = twists(odometry(), [(0, 0), (1, 1), (1, 2), (1, 2)])
    assert seen[1] == pytest.approx((D_M / PERIOD_S, 0.0))
    assert seen[2] == pytest.approx((0.5 * D_M / PERIOD_S, D_M / PERIOD_S / SEPARATION_M))
    assert seen[3] == (0.0, 0.0)


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


def test_the_low_pass_of_counts_keeps_their_mean_and_damps_their_quantum():
    """A count every fourth report: 0, 0, 0, 1 times the quantum."""
    seen = twists(odometry(velocity_low_pass=0.3), [(index // 4, index // 4) for index in range(400)])
    linear_mps = [linear for linear, _ in seen[200:]]
    assert sum(linear_mps) / len(linear_mps) == pytest.approx(0.25 * D_M / PERIOD_S, rel=0.02)
    assert max(linear_mps) - min(linear_mps) < 0.25 * D_M / PERIOD_S


def test_the_low_pass_goes_by_time_and_not_by_reports():
    """Over a gap it forgets more: two steps of 50 ms are about one of 100 ms, for a time constant much longer."""
    linear_mps = []
    for times in ((0, 1, 2), (0, 2)):
        wheel_odometry = odometry(velocity_low_pass=2.0)
        for index in times:
            estimate = wheel_odometry.update(index * PERIOD_NS, 0, 0, (4.0, 4.0) if index else (0.0, 0.0))
        linear_mps.append(estimate.linear_velocity_mps)
    assert linear_mps[0] == pytest.approx(linear_mps[1], rel=0.03)


@pytest.mark.parametrize('measured', [(), ((0.0, 0.0),)])
def test_at_standstill_the_low_pass_decays_to_zero(measured):
    wheel_odometry = odometry(velocity_low_pass=0.1)
    driving = [(index, index, *([(3.14, 3.14)] if measured else [])) for index in range(20)]
    linear_mps, angular_radps = twists(wheel_odometry, driving + [(19, 19, *measured)] * 60)[-1]
    assert (linear_mps, angular_radps) == pytest.approx((0.0, 0.0), abs=1e-6)


def test_a_reset_forgets_the_speeds():
    wheel_odometry = odometry(velocity_low_pass=1.0)
    wheel_odometry.update(0, 0, 0, (5.0, 5.0))
    wheel_odometry.reset()
    assert wheel_odometry.update(PERIOD_NS, 0, 0, (1.0, 1.0)).linear_velocity_mps == pytest.approx(0.1)
