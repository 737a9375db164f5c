"""Many draws at once end where odometry ends one by one."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from diff_encoder_sim.wheels.drawn_counts import base_poses, final_poses
from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder
from encoder_drives import JOINTS, SEPARATION_M, TICK_NS, m_per_pulse

REPORT_TICKS = 5


def one_by_one(angles_rad, ppr, axle_x_m):
    """The counts of the components that nodes run since the first, (reports, 2), and their final pose."""
    encoder = ReportingEncoder(EncoderParams(ppr=ppr))
    odometry = WheelOdometry(OdometryParams(ppr=ppr, max_wheel_speed=1e6, max_wheel_acceleration=1e9, axle_x=axle_x_m))
    counts = []
    for index, angles in enumerate(angles_rad.tolist()):
        for sample in encoder.update(index * REPORT_TICKS * TICK_NS, JOINTS, angles):
            estimate = odometry.update(*sample)
            counts.append(odometry.counts)
    return np.array(counts), estimate.base_pose_in_odom


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(2, 60),
    st.sampled_from([1, 40, 90, 1024, 8192]),
    st.floats(0.0, 3.0),
    st.sampled_from([0.0, 0.2]),
)
def test_any_drive_ends_as_one_by_one(seed, reports, ppr, step_rad, axle_x_m):
    rng = np.random.default_rng(seed)
    turned = np.cumsum(rng.uniform(-step_rad, step_rad, (reports, 2)), axis=0)
    singles = [one_by_one(turned + start, ppr, axle_x_m) for start in rng.uniform(0.0, 2.0 * math.pi, (3, 2))]
    ways_m = m_per_pulse(ppr) * np.array([counts for counts, _ in singles])
    many = base_poses(final_poses(ways_m[:, :, 0], ways_m[:, :, 1], SEPARATION_M), axle_x_m)
    for (x_m, y_m, yaw_rad), (_, pose) in zip(many, singles):
        assert (x_m, y_m) == pytest.approx((pose.x_m, pose.y_m), abs=1e-9)
        assert math.remainder(yaw_rad - pose.yaw_rad, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)


def test_a_straight_drive_spreads_as_the_closed_form_says():
    """(S d/L) sqrt(1/6) across and (d/L) sqrt(1/3) in heading, docs/adr/0002-odometry-covariance.md."""
    rng, length_m, draws = np.random.default_rng(1), 20.0, 4000
    pulse_m = m_per_pulse(360)
    lengths_m = length_m + rng.uniform(0.0, 0.1, (draws, 1))  # ends anywhere within a pulse
    pulses = lengths_m / pulse_m * np.linspace(0.0, 1.0, 400)
    left_m, right_m = (pulse_m * np.floor(rng.uniform(size=(draws, 1)) + pulses) for _ in range(2))
    poses = final_poses(left_m, right_m, SEPARATION_M)
    assert poses[:, 1].std() == pytest.approx(length_m * pulse_m / SEPARATION_M * math.sqrt(1 / 6), rel=0.05)
    assert poses[:, 2].std() == pytest.approx(pulse_m / SEPARATION_M * math.sqrt(1 / 3), rel=0.05)
