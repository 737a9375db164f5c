"""Many draws at once end where encoder and odometry end one by one."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from diff_encoder_sim.encoders.wheel_encoder import EncoderParams, ReportingEncoder
from diff_encoder_sim.odometry import drawn_odometry
from diff_encoder_sim.odometry.drawn_odometry import final_poses
from diff_encoder_sim.odometry.odometry_params import OdometryParams
from diff_encoder_sim.odometry.wheel_odometry import WheelOdometry
from encoder_drives import JOINTS, RADIUS_M, SEPARATION_M, TICK_NS

REPORT_TICKS = 5


def one_by_one(turned_rad, start_rad, ppr):
    """The final pose of the components that nodes run, for (reports, 2) angles."""
    encoder = ReportingEncoder(EncoderParams(ppr=ppr))
    odometry = WheelOdometry(OdometryParams(ppr=ppr, max_wheel_speed=1e6, max_wheel_acceleration=1e9))
    for index, angles in enumerate((start_rad + turned_rad).tolist()):
        for sample in encoder.update(index * REPORT_TICKS * TICK_NS, JOINTS, angles):
            estimate = odometry.update(*sample)
    return estimate.base_pose_in_odom


def many(turned_rad, starts_rad, ppr):
    return final_poses(turned_rad, starts_rad, ppr, 2.0 * RADIUS_M, SEPARATION_M)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 60), st.sampled_from([1, 40, 90, 1024, 8192]), st.floats(0.0, 3.0))
def test_any_drive_ends_as_one_by_one(seed, reports, ppr, step_rad):
    rng = np.random.default_rng(seed)
    turned = np.cumsum(rng.uniform(-step_rad, step_rad, (reports, 2)), axis=0)
    turned -= turned[0]
    starts = rng.uniform(0.0, 2.0 * math.pi, (3, 2))
    for start, (x_m, y_m, yaw_rad) in zip(starts, many(turned, starts, ppr)):
        pose = one_by_one(turned, start, ppr)
        assert (x_m, y_m) == pytest.approx((pose.x_m, pose.y_m), abs=1e-9)
        assert math.remainder(yaw_rad - pose.yaw_rad, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)


def test_a_straight_drive_spreads_as_the_closed_form_says():
    """(S d/L) sqrt(1/6) across and (d/L) sqrt(1/3) in heading, docs/adr/0002-odometry-covariance.md."""
    rng, length_m, ppr = np.random.default_rng(1), 20.0, 360
    lengths_m = length_m + rng.uniform(0.0, 0.1, 4000)  # ends anywhere within a pulse
    turned = lengths_m[:, None, None] / RADIUS_M * np.linspace(0.0, 1.0, 400)[None, :, None] * np.ones(2)
    poses = many(turned, rng.uniform(0.0, 2.0 * math.pi, (4000, 2)), ppr)
    d_m = 2.0 * math.pi * RADIUS_M / ppr
    assert poses[:, 1].std() == pytest.approx(length_m * d_m / SEPARATION_M * math.sqrt(1 / 6), rel=0.05)
    assert poses[:, 2].std() == pytest.approx(d_m / SEPARATION_M * math.sqrt(1 / 3), rel=0.05)


def test_portions_do_not_change_the_result(monkeypatch):
    rng = np.random.default_rng(2)
    turned, starts = np.cumsum(rng.uniform(0.0, 0.5, (50, 2)), axis=0), rng.uniform(0.0, 6.0, (17, 2))
    at_once = many(turned, starts, 90)
    monkeypatch.setattr(drawn_odometry, 'POSES_AT_A_TIME', 150)
    assert np.array_equal(many(turned, starts, 90), at_once)
