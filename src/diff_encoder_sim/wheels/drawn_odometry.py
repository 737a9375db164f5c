"""Odometry of one drive with many encoders at once: where it ends, for many draws of what the wheels turned."""

from __future__ import annotations

import numpy as np


def final_poses(left_m: np.ndarray, right_m: np.ndarray, wheel_separation_m: float) -> np.ndarray:
    """Return where `WheelOdometry` ends when it is told these ways of the wheels.

    Args:
        left_m: (draws, reports) way of the left wheel since the start, as odometry has it of the counts.
        right_m: likewise.
        wheel_separation_m: as odometry assumes it.

    Returns:
        (draws, 3) x [m], y [m] and yaw [rad], which is not wrapped, of the axle's middle from its pose at the start.
    """
    yaw_rad = (right_m - left_m) / wheel_separation_m
    half_turn_rad = 0.5 * np.diff(yaw_rad, axis=1)
    # A chord is shorter than its arc by sin(t/2) / (t/2); np.sinc has the pi in it.
    chord_m = 0.5 * np.diff(left_m + right_m, axis=1) * np.sinc(half_turn_rad / np.pi)
    chord_yaw_rad = yaw_rad[:, :-1] + half_turn_rad
    x_m, y_m = (chord_m * np.cos(chord_yaw_rad)).sum(axis=1), (chord_m * np.sin(chord_yaw_rad)).sum(axis=1)
    return np.column_stack([x_m, y_m, yaw_rad[:, -1]])


def base_poses(axle_poses: np.ndarray, axle_x_m: float) -> np.ndarray:
    """Return (draws, 3) the poses of the robot's base from its pose at the start.

    Args:
        axle_poses: (draws, 3) of the axle's middle from its pose at the start.
        axle_x_m: how far ahead of the base the axle is.
    """
    x_m, y_m, yaw_rad = axle_poses.T
    return np.column_stack([x_m + axle_x_m * (1.0 - np.cos(yaw_rad)), y_m - axle_x_m * np.sin(yaw_rad), yaw_rad])
