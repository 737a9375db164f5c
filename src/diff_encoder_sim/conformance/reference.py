"""Exact odometry, the reference of the suite: equation (1) and exact arcs. Independent of the odometry of this package.

Only numpy and the standard library are imported, which a test checks: an error of this package's odometry cannot hide
here.
"""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np


def counts_of_angles(angles_rad: np.ndarray, ppr: float) -> np.ndarray:
    """Return (n, 2) int64 counts of (n, 2) wheel angles by equation (1): the floor, also below zero."""
    return np.floor(angles_rad * (ppr / (2.0 * math.pi))).astype(np.int64)


def wrapped(counts: np.ndarray, modulus: int) -> np.ndarray:
    """Return counts as a signed counter of `modulus` states shows them; 0: it does not wrap."""
    return counts if not modulus else (counts + modulus // 2) % modulus - modulus // 2


def exact_path(travels_m: np.ndarray, separation_m: float) -> np.ndarray:
    """Return (n, 3) poses x [m], y [m] and yaw [rad], not wrapped, of wheels with (n, 2) travels [m], from pose zero.

    Each step is an arc of constant curvature: its chord is s sin(t/2) / (t/2) at half of its turn t.
    """
    steps_m = np.diff(travels_m, axis=0)
    turned_rad = (travels_m[:, 1] - travels_m[:, 0] - (travels_m[0, 1] - travels_m[0, 0])) / separation_m
    half_rad = 0.5 * np.diff(turned_rad)
    chords_m = 0.5 * steps_m.sum(axis=1) * np.sinc(half_rad / math.pi)
    moved_m = chords_m * np.exp(1j * (turned_rad[:-1] + half_rad))
    position_m = np.concatenate(([0j], np.cumsum(moved_m)))
    return np.column_stack((position_m.real, position_m.imag, turned_rad))


def relative_pose(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return (3,) the pose `end` in the frame of the pose `start`, yaw in [-pi, pi)."""
    moved_m = complex(*(end[:2] - start[:2])) * np.exp(-1j * start[2])
    return np.array([moved_m.real, moved_m.imag, wrapped_angle(end[2] - start[2])])


def wrapped_angle(angle_rad: float) -> float:
    """Return the same direction in [-pi, pi)."""
    return float((angle_rad + math.pi) % (2.0 * math.pi) - math.pi)


def pose_errors(found: np.ndarray, expected: np.ndarray) -> Tuple[float, float]:
    """Return distance [m] and angle [rad] between two poses (3,)."""
    return float(np.hypot(*(found - expected)[:2])), abs(wrapped_angle(found[2] - expected[2]))


def nees(error: np.ndarray, covariance: np.ndarray) -> float:
    """Return the normalized estimation error squared of a planar pose: 3 on average if the covariance is honest."""
    return float(error @ np.linalg.solve(covariance, error))
