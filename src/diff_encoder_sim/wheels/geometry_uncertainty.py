"""What odometry does not know of its wheels moves the pose as the drive goes on: a bias, not a random walk.

The three errors are those that calibrations find: of the distance (diameters), of the turn (diameters and separation),
and of one diameter against the other. The reasons are in docs/adr/0031-covariance-follows-robot.md.
"""

from __future__ import annotations

import math
from typing import Iterable, NamedTuple, Tuple

from diff_encoder_sim.wheels.odometry_covariance import PlanarCovariance


class GeometryStd(NamedTuple):
    """Standard deviations of relative errors that the geometry which odometry assumes makes."""

    distance: float = 0.0
    turn: float = 0.0
    diameter_difference: float = 0.0  # right minus left, of their mean


KNOWN_EXACTLY = GeometryStd()


# What a relative error of 1, to first order, adds to x [m], y [m] and yaw [rad]: of the distance, the turn and the
# diameters' difference.
Columns = Tuple[Tuple[float, float, float], Tuple[float, float, float], Tuple[float, float, float]]
NO_ERRORS: Columns = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def carry_geometry_errors(
    errors: Columns, std: GeometryStd, yaw_rad: float, left_m: float, right_m: float, wheel_separation_m: float
) -> Columns:
    """Return how the geometry's errors move the pose after one more step of both wheels.

    Args:
        errors: before the step.
        std: of the errors; those of 0 are left as they are.
        yaw_rad: heading before the step.
        left_m: travel of the left wheel.
        right_m: travel of the right wheel.
        wheel_separation_m: between the contact points.
    """
    travel_m, turn_rad = 0.5 * (left_m + right_m), (right_m - left_m) / wheel_separation_m
    mid_yaw_rad = yaw_rad + 0.5 * turn_rad
    cos_yaw, sin_yaw = math.cos(mid_yaw_rad), math.sin(mid_yaw_rad)
    steps = ((travel_m, 0.0), (0.0, turn_rad), (0.25 * (right_m - left_m), travel_m / wheel_separation_m))
    distance, turn, difference = (
        _carried(column, *step, travel_m, cos_yaw, sin_yaw) if spread else column
        for column, step, spread in zip(errors, steps, std)
    )
    return distance, turn, difference


def _carried(
    column: Tuple[float, float, float], along_m: float, by_rad: float, travel_m: float, cos_yaw: float, sin_yaw: float
) -> Tuple[float, float, float]:
    """Return what an error has moved the pose by, after a step that it makes longer by `along_m` and turns further."""
    x_m, y_m, yaw_rad = column
    across_m = travel_m * (yaw_rad + 0.5 * by_rad)
    return (
        x_m + cos_yaw * along_m - sin_yaw * across_m,
        y_m + sin_yaw * along_m + cos_yaw * across_m,
        yaw_rad + by_rad,
    )


def geometry_covariance(errors: Columns, std: GeometryStd) -> PlanarCovariance:
    """Return the covariance that errors of these standard deviations, which are independent, cause."""
    return _covariance_of(errors, (std.distance**2, std.turn**2, std.diameter_difference**2))


def _covariance_of(columns: Iterable[Tuple[float, float, float]], variances: Iterable[float]) -> PlanarCovariance:
    """Return the covariance of a sum of columns (x, y, yaw), each times an error of its own variance."""
    xx = xy = yy = x_yaw = y_yaw = yaw_yaw = 0.0
    for (x, y, yaw), variance in zip(columns, variances):
        if not variance:
            continue
        xx += variance * x * x
        xy += variance * x * y
        yy += variance * y * y
        x_yaw += variance * x * yaw
        y_yaw += variance * y * yaw
        yaw_yaw += variance * yaw * yaw
    return PlanarCovariance(xx, xy, x_yaw, yy, y_yaw, yaw_yaw)
