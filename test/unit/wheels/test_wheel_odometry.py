"""Odometry over given and over random motions."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from diff_encoder_sim.base.se2 import wrap_angle
from diff_encoder_sim.wheels.encoder_params import wrap_count
from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams

MS = 1_000_000
DIAMETER_M, SEPARATION_M = 0.2, 0.4
PPRS = [40, 90, 1024, 4096]


def metres_per_pulse(ppr):
    return math.pi * DIAMETER_M / ppr


def odometry(**params):
    return WheelOdometry(
        OdometryParams.from_mapping({'max_wheel_speed': 1e9, 'max_wheel_acceleration': 1e9, **params}, 'test')
    )


def test_the_first_report_is_pose_zero_whatever_it_counts():
    estimate = odometry().update(123, -98765, 4321)
    assert estimate.base_pose_in_odom == (0, 0, 0)
    assert (estimate.linear_velocity_mps, estimate.angular_velocity_radps) == (0, 0)
    assert np.isfinite(estimate.pose_covariance).all()


@pytest.mark.parametrize('ppr', PPRS)
def test_one_revolution_of_both_wheels_is_one_circumference_ahead(ppr):
    wheel_odometry = odometry(ppr=ppr)
    wheel_odometry.update(0, 7, -7)
    pose = wheel_odometry.update(50 * MS, 7 + ppr, ppr - 7).base_pose_in_odom
    assert pose == pytest.approx((math.pi * DIAMETER_M, 0, 0))


def test_opposite_wheels_turn_on_the_spot_counter_clockwise():
    wheel_odometry = odometry(ppr=100)
    wheel_odometry.update(0, 0, 0)
    # A quarter turn is L pi/4 of each wheel: half a revolution of a wheel half as wide as L.
    pose = wheel_odometry.update(50 * MS, -50, 50).base_pose_in_odom
    assert pose == pytest.approx((0, 0, math.pi / 2))


def test_one_wheel_alone_turns_about_the_other():
    wheel_odometry = odometry(ppr=100)
    wheel_odometry.update(0, 0, 0)
    pose = wheel_odometry.update(50 * MS, 0, 100).base_pose_in_odom  # pi/2 about the left wheel
    assert pose == pytest.approx((SEPARATION_M / 2, SEPARATION_M / 2, math.pi / 2))


def test_per_wheel_resolution():
    wheel_odometry = odometry(ppr={'left': 40, 'right': 4096})
    wheel_odometry.update(0, 0, 0)
    assert wheel_odometry.update(50 * MS, 40, 4096).base_pose_in_odom == pytest.approx((math.pi * DIAMETER_M, 0, 0))


increments = st.lists(st.tuples(st.integers(-30, 30), st.integers(-30, 30)), min_size=1, max_size=40)


@given(increments, st.integers(-(10**6), 10**6), st.integers(-(10**6), 10**6))
def test_the_start_value_of_the_counters_does_not_matter(steps, left_start, right_start):
    from_zero, from_start = odometry(), odometry()
    totals = np.cumsum([(0, 0)] + steps, axis=0).tolist()
    for index, (left, right) in enumerate(totals):
        expected = from_zero.update(index * 50 * MS, left, right)
        given_start = from_start.update(index * 50 * MS, left + left_start, right + right_start)
    assert given_start.base_pose_in_odom == expected.base_pose_in_odom


@given(increments, st.sampled_from([128, 255, 65536]), st.integers(-(10**6), 10**6))
def test_a_wrapping_counter_gives_the_same_poses_as_an_endless_one(steps, modulus, start):
    endless, wrapping = odometry(), odometry(counter_modulus=modulus)
    totals = (np.cumsum([(0, 0)] + steps, axis=0) + start).tolist()
    for index, (left, right) in enumerate(totals):
        expected = endless.update(index * 50 * MS, left, right)
        wrapped = wrapping.update(index * 50 * MS, wrap_count(left, modulus), wrap_count(right, modulus))
        assert wrapped.base_pose_in_odom == expected.base_pose_in_odom


@given(increments)
def test_driving_back_the_same_way_ends_where_it_began(steps):
    wheel_odometry = odometry()
    totals = np.cumsum([(0, 0)] + steps + [(-left, -right) for left, right in reversed(steps)], axis=0).tolist()
    for index, (left, right) in enumerate(totals):
        pose = wheel_odometry.update(index * 50 * MS, left, right).base_pose_in_odom
    assert pose == pytest.approx((0, 0, 0), abs=1e-9)


@given(st.integers(-40, 40), st.integers(-40, 40), st.integers(1, 25))
def test_an_arc_gives_the_same_pose_however_it_is_split(left, right, pieces):
    whole, split = odometry(), odometry()
    whole.update(0, 0, 0)
    expected = whole.update(50 * MS, left * pieces, right * pieces).base_pose_in_odom
    for index in range(pieces + 1):
        pose = split.update(index * 50 * MS, left * index, right * index).base_pose_in_odom
    assert pose == pytest.approx(expected, abs=1e-9)


@given(increments, st.integers(2, 7))
def test_the_heading_is_the_same_however_any_motion_is_sampled(steps, keep_every):
    totals = np.cumsum([(0, 0)] + steps, axis=0).tolist()
    headings = []
    for samples in (totals, totals[:-1:keep_every] + totals[-1:]):
        wheel_odometry = odometry()
        for index, (left, right) in enumerate(samples):
            estimate = wheel_odometry.update(index * 50 * MS, left, right)
        headings.append(estimate.base_pose_in_odom.yaw_rad)
    assert headings[0] == headings[1]


def test_the_heading_does_not_drift_over_a_million_reports():
    """A third of a pulse cannot be represented; adding it up a million times must not show."""
    wheel_odometry = odometry(ppr=3 * 7 * 11)
    for index in range(0, 1_000_001, 1000):
        estimate = wheel_odometry.update(index * 50 * MS, -index, index)
    expected = 2 * 1_000_000 * metres_per_pulse(3 * 7 * 11) / SEPARATION_M
    assert estimate.base_pose_in_odom.yaw_rad == pytest.approx(wrap_angle(expected), abs=1e-9)


def test_the_twist_is_signed_in_both_directions():
    wheel_odometry = odometry(ppr=100)
    wheel_odometry.update(0, 0, 0)
    ahead = wheel_odometry.update(100 * MS, 10, 10)
    back = wheel_odometry.update(200 * MS, 0, 0)
    right = wheel_odometry.update(300 * MS, 10, -10)
    speed_mps = 10 * metres_per_pulse(100) / 0.1
    assert ahead.linear_velocity_mps == pytest.approx(speed_mps)
    assert back.linear_velocity_mps == pytest.approx(-speed_mps)
    assert right.angular_velocity_radps == pytest.approx(-2 * speed_mps / SEPARATION_M)


def test_one_pulse_in_50_ms_at_40_ppr_is_what_the_controller_sees():
    wheel_odometry = odometry(ppr=40)
    wheel_odometry.update(0, 0, 0)
    both = wheel_odometry.update(50 * MS, 1, 1)
    assert both.linear_velocity_mps == pytest.approx(0.314, abs=5e-4)
    one = wheel_odometry.update(100 * MS, 1, 2)
    assert one.angular_velocity_radps == pytest.approx(0.785, abs=5e-4)


def test_a_window_averages_the_twist_over_that_many_reports():
    wheel_odometry = odometry(ppr=100, velocity_window=4)
    counts = [0, 1, 3, 6, 10, 15]
    speeds = [
        wheel_odometry.update(index * 50 * MS, count, count).linear_velocity_mps for index, count in enumerate(counts)
    ]
    d = metres_per_pulse(100)
    assert speeds == pytest.approx([0, 1 * d / 0.05, 3 * d / 0.1, 6 * d / 0.15, 10 * d / 0.2, 14 * d / 0.2])


def test_stale_reports_are_ignored():
    wheel_odometry = odometry()
    wheel_odometry.update(1000 * MS, 0, 0)
    assert wheel_odometry.update(1000 * MS, 50, 50) is None
    assert wheel_odometry.update(950 * MS, 50, 50) is None
    assert wheel_odometry.update(1050 * MS, 0, 0).base_pose_in_odom == (0, 0, 0)


def test_time_that_jumps_back_restarts_at_zero_with_one_warning(caplog):
    wheel_odometry = odometry(ppr=100)
    for index in range(10):
        wheel_odometry.update(10_000 * MS + index * 50 * MS, 10 * index, 10 * index)
    restarted = wheel_odometry.update(0, 500, 500)
    assert restarted.base_pose_in_odom == (0, 0, 0)
    assert restarted.linear_velocity_mps == 0
    again = wheel_odometry.update(50 * MS, 510, 510)
    assert again.base_pose_in_odom.x_m == pytest.approx(10 * metres_per_pulse(100))
    assert [record.levelname for record in caplog.records] == ['WARNING']


def test_a_counter_that_restarts_keeps_the_pose_with_one_warning(caplog):
    wheel_odometry = odometry(ppr=100, max_wheel_speed=100.0)
    wheel_odometry.update(0, 10_000, 10_000)
    before = wheel_odometry.update(50 * MS, 10_010, 10_010)
    after = wheel_odometry.update(100 * MS, 0, 0)
    assert after.base_pose_in_odom == before.base_pose_in_odom
    assert wheel_odometry.update(150 * MS, 10, 10).base_pose_in_odom.x_m == pytest.approx(20 * metres_per_pulse(100))
    assert [record.levelname for record in caplog.records] == ['WARNING']
    assert 'max_wheel_speed' in caplog.text


def test_reset_takes_the_next_report_as_the_start():
    wheel_odometry = odometry()
    wheel_odometry.update(0, 0, 0)
    wheel_odometry.update(50 * MS, 9, 9)
    wheel_odometry.reset()
    assert wheel_odometry.update(50 * MS, 9, 9) is None  # its stamp has been published already
    assert wheel_odometry.update(100 * MS, 18, 18).base_pose_in_odom == (0, 0, 0)


@given(
    st.lists(
        st.tuples(st.integers(-5, 200), st.integers(-(2**63), 2**63 - 1), st.integers(-(2**63), 2**63 - 1)), max_size=30
    ),
    st.sampled_from([0, 65536]),
)
@settings(max_examples=200)
def test_no_sequence_of_reports_makes_a_number_that_is_not_finite(reports, modulus):
    wheel_odometry = WheelOdometry(OdometryParams(counter_modulus=modulus))
    for stamp_ms, left, right in reports:
        estimate = wheel_odometry.update(stamp_ms * MS, left, right)
        if estimate is not None:
            assert np.isfinite(
                [*estimate.base_pose_in_odom, estimate.linear_velocity_mps, estimate.angular_velocity_radps]
            ).all()
            assert np.isfinite(estimate.pose_covariance).all()
            assert np.isfinite(estimate.twist_covariance).all()
            assert np.linalg.eigvalsh(estimate.pose_covariance).min() > -1e-9


def test_quantisation_stays_bounded_where_the_robot_turns_on_the_spot_for_ever():
    d = metres_per_pulse(40)
    wheel_odometry = odometry(ppr=40, motion_noise=0.0)
    for index in range(2000):
        estimate = wheel_odometry.update(index * 50 * MS, -3 * index, 3 * index)
    assert estimate.pose_covariance[2, 2] == pytest.approx((d / SEPARATION_M) ** 2 / 3)
