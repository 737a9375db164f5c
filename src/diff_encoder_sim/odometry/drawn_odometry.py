"""Odometry of one drive with many encoders at once: the final poses of many draws of where the wheels stood."""

from __future__ import annotations

import numpy as np

# So many poses at a time: beyond, arrays leave the processor's cache [poses].
POSES_AT_A_TIME = 2**18


def final_poses(
    turned_rad: np.ndarray,
    starts_rad: np.ndarray,
    counts_per_turn: float,
    wheel_diameter_m: float,
    wheel_separation_m: float,
) -> np.ndarray:
    """Return where the odometry of ideal encoders ends, as `WheelOdometry` computes it from equation (1).

    Args:
        turned_rad: (reports, 2) angles of the left and right wheel since the start, or (draws, reports, 2).
        starts_rad: (draws, 2) angles at the start.
        counts_per_turn: of either wheel.
        wheel_diameter_m: as odometry assumes it.
        wheel_separation_m: as odometry assumes it.

    Returns:
        (draws, 3) x [m], y [m] and yaw [rad], which is not wrapped, from the pose at the start.
    """
    reports = turned_rad.shape[-2]
    at_a_time = max(1, POSES_AT_A_TIME // max(reports, 1))
    m_per_pulse = np.pi * wheel_diameter_m / counts_per_turn
    poses = np.empty((len(starts_rad), 3))
    for first in range(0, len(starts_rad), at_a_time):
        of_draws = slice(first, first + at_a_time)
        turned = turned_rad if turned_rad.ndim == 2 else turned_rad[of_draws]
        counts = np.floor((starts_rad[of_draws, None] + turned) * (counts_per_turn / (2.0 * np.pi)))
        ways_m = (counts - counts[:, :1]) * m_per_pulse
        poses[of_draws] = _ends(ways_m, wheel_separation_m)
    return poses


def _ends(ways_m: np.ndarray, wheel_separation_m: float) -> np.ndarray:
    """Return (draws, 3) the ends of paths of arcs between (draws, reports, 2) ways of the wheels since the start."""
    left_m, right_m = ways_m[..., 0], ways_m[..., 1]
    yaw_rad = (right_m - left_m) / wheel_separation_m
    half_turn_rad = 0.5 * np.diff(yaw_rad, axis=1)
    # A chord is shorter than its arc by sin(t/2) / (t/2); np.sinc has the pi in it.
    chord_m = 0.5 * np.diff(left_m + right_m, axis=1) * np.sinc(half_turn_rad / np.pi)
    chord_yaw_rad = yaw_rad[:, :-1] + half_turn_rad
    x_m, y_m = (chord_m * np.cos(chord_yaw_rad)).sum(axis=1), (chord_m * np.sin(chord_yaw_rad)).sum(axis=1)
    return np.column_stack([x_m, y_m, yaw_rad[:, -1]])
