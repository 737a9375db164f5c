"""What odometry does not know of its wheels moves the pose as the drive goes on: a bias, not a random walk.

The three errors are those that calibrations find: of the distance (diameters), of the turn (diameters and separation),
and of one diameter against the other. The reasons are in docs/adr/0031-covariance-follows-robot.md.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np


class GeometryStd(NamedTuple):
    """Standard deviations of relative errors that the geometry which odometry assumes makes."""

    distance: float = 0.0
    turn: float = 0.0
    diameter_difference: float = 0.0  # right minus left, of their mean


KNOWN_EXACTLY = GeometryStd()


def carry_geometry_errors(
    errors: np.ndarray, yaw_rad: float, left_m: float, right_m: float, wheel_separation_m: float
) -> np.ndarray:
    """Return how the geometry's errors move the pose after one more step of both wheels.

    Args:
        errors: 3x3, before the step: what a relative error of 1, to first order, adds to x [m], y [m] and yaw [rad]
            (rows), of the distance, the turn and the diameters' difference (columns).
        yaw_rad: heading before the step.
        left_m: travel of the left wheel.
        right_m: travel of the right wheel.
        wheel_separation_m: between the contact points.
    """
    travel_m, turn_rad = 0.5 * (left_m + right_m), (right_m - left_m) / wheel_separation_m
    mid_yaw_rad = yaw_rad + 0.5 * turn_rad
    cos_yaw, sin_yaw = math.cos(mid_yaw_rad), math.sin(mid_yaw_rad)
    by_travel = np.array([travel_m, 0.0, 0.25 * (right_m - left_m)])
    by_turn = np.array([0.0, turn_rad, travel_m / wheel_separation_m])
    across_m = travel_m * (errors[2] + 0.5 * by_turn)
    step: np.ndarray = np.stack(
        [cos_yaw * by_travel - sin_yaw * across_m, sin_yaw * by_travel + cos_yaw * across_m, by_turn]
    )
    carried: np.ndarray = errors + step
    return carried


def geometry_covariance(errors: np.ndarray, std: GeometryStd) -> np.ndarray:
    """Return the 3x3 covariance of (x, y, yaw) that errors of these standard deviations cause.

    Args:
        errors: 3x3, of `carry_geometry_errors`.
        std: of the three errors, which are independent.
    """
    scaled = errors * np.array(std)
    covariance: np.ndarray = scaled @ scaled.T
    return covariance
