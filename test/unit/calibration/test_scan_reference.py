"""Poses of the laser by its scans, in a room, with odometry of a wrong geometry as the start."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import Pose2D, PoseSeries, poses_of_wheels, wrap_angles
from diff_encoder_sim.calibration.scan_reference import PERIOD_NS, scan_reference
from slam_room import room_scan

LASER = Pose2D(0.1, -0.03, 0.2)
NOMINAL = 0.05, 0.05, 0.3  # radii, separation [m]
TRUE = 0.05 * 1.004, 0.05 * 0.996, 0.3 * 1.01
STEPS = 150


def wheel_drive():
    """Angles (n, 2) [rad] of two circles to the left, and two to the right."""
    yaw_rad = 4.0 * math.pi * (1.0 - np.abs(np.linspace(-1.0, 1.0, STEPS)))
    ahead_m = 0.6 * 4.0 * math.pi * np.linspace(0.0, 2.0, STEPS)
    return np.column_stack([ahead_m - 0.15 * yaw_rad, ahead_m + 0.15 * yaw_rad]) / 0.05


def base_poses(angles_rad, left_m, right_m, separation_m):
    return poses_of_wheels(angles_rad[np.newaxis], left_m, right_m, separation_m, 0.0, False)[0]


@pytest.fixture(scope='module')
def found():
    """The reference, and the true poses of the laser."""
    angles_rad, rng = wheel_drive(), np.random.default_rng(1)
    stamps_ns = PERIOD_NS * np.arange(STEPS)
    true = [Pose2D(*pose) for pose in base_poses(angles_rad, *TRUE).tolist()]
    scans = [
        room_scan(pose, rng, 0.02, laser_pose_in_base=LASER, stamp_ns=int(stamp_ns))
        for pose, stamp_ns in zip(true, stamps_ns)
    ]
    reference = scan_reference(scans, PoseSeries(stamps_ns, base_poses(angles_rad, *NOMINAL)), LASER)
    return reference, np.array([pose.compose(LASER) for pose in true])


def test_the_laser_is_found_to_millimetres_and_milliradians_although_odometry_is_wrong(found):
    reference, true = found
    odometry = np.array([Pose2D(*pose).compose(LASER) for pose in base_poses(wheel_drive(), *NOMINAL).tolist()])
    assert np.hypot(*(odometry - true)[:, :2].T).max() > 0.05
    errors = reference.poses - true
    errors[:, 2] = wrap_angles(errors[:, 2])
    assert np.hypot(*errors[:, :2].T).max() < 0.012
    assert errors.std(axis=0) == pytest.approx([0.0, 0.0, 0.0], abs=0.003)
    assert reference.covariances.shape == (STEPS, 3, 3)
    assert np.linalg.eigvalsh(reference.covariances).min() > 0.0
    within = np.sqrt(np.diagonal(reference.covariances, axis1=1, axis2=2).mean(axis=0))
    assert np.all(errors.std(axis=0) < 2.5 * within)


def test_the_heading_determines_ratio_of_radii_and_radius_over_separation_within_two_per_mille(found):
    yaw_rad = np.unwrap(found[0].poses[:, 2])
    design = np.column_stack([wheel_drive(), np.ones(STEPS)])
    left, right, _ = np.linalg.lstsq(design, yaw_rad, rcond=None)[0]  # radius over separation, of the left one negative
    assert -left == pytest.approx(TRUE[0] / TRUE[2], rel=2e-3)
    assert right / -left == pytest.approx(TRUE[1] / TRUE[0], rel=2e-3)


def test_scans_too_close_in_time_and_outside_of_odometry_are_left_out():
    odometry = PoseSeries(np.array([0, 10 * PERIOD_NS]), np.zeros((2, 3)))
    scans = [
        room_scan(Pose2D(0.0, 0.0, 0.0), stamp_ns=stamp_ns)
        for stamp_ns in range(-PERIOD_NS, 12 * PERIOD_NS, PERIOD_NS // 4)
    ]
    reference = scan_reference(scans, odometry)
    assert reference.stamps_ns.tolist() == [PERIOD_NS * index for index in range(11)]
    with pytest.raises(ConfigError, match='scans: given 1 usable scans at the times of odometry; allowed: at least 2'):
        scan_reference(scans[:5], odometry)
