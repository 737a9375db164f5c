"""Odometry over given and over random motions."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

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


@pytest.mark.parametrize('ppr', PPRS)
def test_one_revolution_of_both_wheels_is_one_circumference_ahead(ppr):
    wheel_odometry = odometry(ppr=ppr)
    wheel_odometry.update(0, 7, -7)
    pose = wheel_odometry.update(50 * MS, 7 + ppr, ppr - 7).base_pose_in_odom
    assert pose == pytest.approx((math.pi * DIAMETER_M, 0, 0))


def test_one_wheel_alone_turns_about_the_other():
    wheel_odometry = odometry(ppr=100)
    wheel_odometry.update(0, 0, 0)
    pose = wheel_odometry.update(50 * MS, 0, 100).base_pose_in_odom  # pi/2 about the left wheel
    assert pose == pytest.approx((SEPARATION_M / 2, SEPARATION_M / 2, math.pi / 2))


increments = st.lists(st.tuples(st.integers(-30, 30), st.integers(-30, 30)), min_size=1, max_size=40)


@given(increments, st.sampled_from([128, 255, 65536]), st.integers(-(10**6), 10**6))
def test_a_wrapping_counter_gives_the_same_poses_as_an_endless_one(steps, modulus, start):
    endless, wrapping = odometry(), odometry(counter_modulus=modulus)
    totals = (np.cumsum([(0, 0)] + steps, axis=0) + start).tolist()
    for index, (left, right) in enumerate(totals):
        expected = endless.update(index * 50 * MS, left, right)
        wrapped = wrapping.update(index * 50 * MS, wrap_count(left, modulus), wrap_count(right, modulus))
        assert wrapped.base_pose_in_odom == expected.base_pose_in_odom


@given(st.integers(-40, 40), st.integers(-40, 40), st.integers(1, 25))
def test_an_arc_gives_the_same_pose_however_it_is_split(left, right, pieces):
    whole, split = odometry(), odometry()
    whole.update(0, 0, 0)
    expected = whole.update(50 * MS, left * pieces, right * pieces).base_pose_in_odom
    for index in range(pieces + 1):
        pose = split.update(index * 50 * MS, left * index, right * index).base_pose_in_odom
    assert pose == pytest.approx(expected, abs=1e-9)


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


def test_a_window_averages_the_twist_over_that_many_reports():
    wheel_odometry = odometry(ppr=100, velocity_window=4)
    counts = [0, 1, 3, 6, 10, 15]
    speeds = [
        wheel_odometry.update(index * 50 * MS, count, count).linear_velocity_mps for index, count in enumerate(counts)
    ]
    d = metres_per_pulse(100)
    assert speeds == pytest.approx([0, 1 * d / 0.05, 3 * d / 0.1, 6 * d / 0.15, 10 * d / 0.2, 14 * d / 0.2])


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


def test_reset_takes_the_next_report_as_the_start():
    wheel_odometry = odometry()
    wheel_odometry.update(0, 0, 0)
    wheel_odometry.update(50 * MS, 9, 9)
    wheel_odometry.reset()
    assert wheel_odometry.update(50 * MS, 9, 9) is None  # its stamp has been published already
    assert wheel_odometry.update(100 * MS, 18, 18).base_pose_in_odom == (0, 0, 0)
