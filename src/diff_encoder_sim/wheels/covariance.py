"""The covariance of wheel odometry: motion noise, quantisation, and uncertain geometry."""

from __future__ import annotations

import math
import operator
from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D

# Variance of a position that is uniform within one pulse, in pulses squared.
PULSE_VARIANCE = 1.0 / 12.0

# Standard deviation, in pulses along x and along y, of the rounding while the robot turns in place, which does not
# quite average out; measured by NEES after whole turns (test/benchmark/odometry_nees.py).
RESIDUAL_PULSES = 0.065


def reading_variance(m_per_pulse: float, of_sensor: float = 0.0) -> float:
    """Return the variance [m^2] of a wheel's travel in one reading; `of_sensor` is added to rounding [pulses^2]."""
    return (PULSE_VARIANCE + of_sensor) * m_per_pulse**2


def residual_std(left_m_per_pulse: float, right_m_per_pulse: float) -> float:
    """Return the standard deviation [m] along x and along y of the rounding while turning in place."""
    return RESIDUAL_PULSES * max(left_m_per_pulse, right_m_per_pulse)


class PlanarCovariance(NamedTuple):
    """A symmetric 3x3 covariance of (x [m], y [m], yaw [rad]): its upper triangle."""

    xx: float = 0.0
    xy: float = 0.0
    x_yaw: float = 0.0
    yy: float = 0.0
    y_yaw: float = 0.0
    yaw_yaw: float = 0.0

    def plus(self, other: PlanarCovariance) -> PlanarCovariance:
        """Return the covariance of the sum of two independent errors."""
        return PlanarCovariance(*map(operator.add, self, other))

    def matrix(self) -> np.ndarray:
        """Return it as 3x3."""
        xx, xy, x_yaw, yy, y_yaw, yaw_yaw = self
        return np.array([[xx, xy, x_yaw], [xy, yy, y_yaw], [x_yaw, y_yaw, yaw_yaw]])

    def carried_by_heading(self, x_per_yaw_m: float, y_per_yaw_m: float) -> PlanarCovariance:
        """Return J C J', with J the identity plus the derivatives of x and y by yaw."""
        xx, xy, x_yaw, yy, y_yaw, yaw_yaw = self
        new_x_yaw, new_y_yaw = x_yaw + x_per_yaw_m * yaw_yaw, y_yaw + y_per_yaw_m * yaw_yaw
        return PlanarCovariance(
            xx + x_per_yaw_m * (x_yaw + new_x_yaw),
            xy + x_per_yaw_m * y_yaw + y_per_yaw_m * new_x_yaw,
            new_x_yaw,
            yy + y_per_yaw_m * (y_yaw + new_y_yaw),
            new_y_yaw,
            yaw_yaw,
        )


def propagate_motion_noise(
    covariance: PlanarCovariance,
    yaw_rad: float,
    left_m: float,
    right_m: float,
    wheel_separation_m: float,
    motion_noise: float,
    heading_var_rad2: float = 0.0,
) -> PlanarCovariance:
    """Return the covariance after one more step of both wheels.

    The travels have independent variances in proportion to their lengths (Siegwart and Nourbakhsh, Introduction to
    Autonomous Mobile Robots, section 5.2.4). Rounding adds an independent heading error to each step, which shifts the
    robot sideways (docs/adr/0002-odometry-covariance.md).

    Args:
        covariance: before the step.
        yaw_rad: heading before the step.
        left_m: travel of the left wheel.
        right_m: travel of the right wheel.
        wheel_separation_m: between the contact points.
        motion_noise: variance per metre of travel [m^2/m].
        heading_var_rad2: variance of the heading within a step, by the rounding of both readings.
    """
    travel_m = 0.5 * (left_m + right_m)
    mid_yaw_rad = yaw_rad + 0.5 * (right_m - left_m) / wheel_separation_m
    cos_yaw, sin_yaw = math.cos(mid_yaw_rad), math.sin(mid_yaw_rad)
    # The Jacobian's columns: a metre of the left wheel adds (a - b, -turn) to the pose, one of the right (a + b, turn).
    turn, lever = 1.0 / wheel_separation_m, 0.5 * travel_m / wheel_separation_m
    ax, ay, bx, by = 0.5 * cos_yaw, 0.5 * sin_yaw, -lever * sin_yaw, lever * cos_yaw
    left_m2, right_m2 = motion_noise * abs(left_m), motion_noise * abs(right_m)
    both_m2, more_m2 = left_m2 + right_m2, right_m2 - left_m2
    # The product of both distances: a pulse of only one wheel is not travel.
    sideways_m2 = heading_var_rad2 * max(left_m * right_m, 0.0)
    xx, xy, x_yaw, yy, y_yaw, yaw_yaw = covariance.carried_by_heading(-travel_m * sin_yaw, travel_m * cos_yaw)
    return PlanarCovariance(
        xx + both_m2 * (ax * ax + bx * bx) + 2.0 * more_m2 * ax * bx + sideways_m2 * sin_yaw * sin_yaw,
        xy + both_m2 * (ax * ay + bx * by) + more_m2 * (ax * by + bx * ay) - sideways_m2 * sin_yaw * cos_yaw,
        x_yaw + turn * (more_m2 * ax + both_m2 * bx),
        yy + both_m2 * (ay * ay + by * by) + 2.0 * more_m2 * ay * by + sideways_m2 * cos_yaw * cos_yaw,
        y_yaw + turn * (more_m2 * ay + both_m2 * by),
        yaw_yaw + turn * turn * both_m2,
    )


def quantisation_covariance(
    base_pose_in_odom: Pose2D, left_var_m2: float, right_var_m2: float, residual_m: float, wheel_separation_m: float
) -> PlanarCovariance:
    """Return the covariance of rounding to whole pulses: bounded, not a random walk.

    Each wheel has a uniform rounding error at the start and now. The error at the start rotates and shifts the whole
    path about the start; the current error rotates and shifts the robot in place. In between they are independent
    (`propagate_motion_noise`). After a straight line of length S the lateral spread is (S d/L) sqrt(1/6); the heading
    spread is always (d/L) sqrt(1/3) (docs/adr/0002-odometry-covariance.md).

    Args:
        base_pose_in_odom: now.
        left_var_m2: variance of the left wheel's travel in one reading, d^2 (1/12 + edge variance).
        right_var_m2: likewise, of the right wheel.
        residual_m: standard deviation along x and y of the rounding while turning in place.
        wheel_separation_m: between the contact points.
    """
    x_m, y_m, yaw_rad = base_pose_in_odom
    half_cos, half_sin = 0.5 * math.cos(yaw_rad), 0.5 * math.sin(yaw_rad)
    turn, x_turns, y_turns = 1.0 / wheel_separation_m, x_m / wheel_separation_m, y_m / wheel_separation_m
    # A metre of the left wheel at the start moves the pose by (1/2 + y/L, -x/L, -1/L), of the right one by
    # (1/2 - y/L, x/L, 1/L); of either now by (cos/2, sin/2, -1/L or 1/L).
    left, right, both, more = 0.5 + y_turns, 0.5 - y_turns, left_var_m2 + right_var_m2, right_var_m2 - left_var_m2
    along = right_var_m2 * right - left_var_m2 * left
    residual = residual_m**2
    return PlanarCovariance(
        left_var_m2 * left**2 + right_var_m2 * right**2 + both * half_cos**2 + residual,
        along * x_turns + both * half_cos * half_sin,
        (along + more * half_cos) * turn,
        both * (x_turns**2 + half_sin**2) + residual,
        (both * x_turns + more * half_sin) * turn,
        2.0 * both * turn**2,
    )


class GeometryStd(NamedTuple):
    """Standard deviations of the relative errors of the assumed geometry."""

    distance: float = 0.0
    turn: float = 0.0
    diameter_difference: float = 0.0  # right minus left, of their mean


KNOWN_EXACTLY = GeometryStd()

# First-order derivatives of x [m], y [m] and yaw [rad] by the relative errors of distance, turn and diameter
# difference: of floats, as arrays of three take several times as long.
Columns = Tuple[Tuple[float, float, float], ...]
NO_ERRORS: Columns = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def carry_geometry_errors(
    errors: Columns, yaw_rad: float, left_m: float, right_m: float, wheel_separation_m: float
) -> Columns:
    """Return the effect of the geometry errors on the pose after one more step, as `propagate_motion_noise`."""
    travel_m, turn_rad = 0.5 * (left_m + right_m), (right_m - left_m) / wheel_separation_m
    mid_yaw_rad = yaw_rad + 0.5 * turn_rad
    cos_yaw, sin_yaw = math.cos(mid_yaw_rad), math.sin(mid_yaw_rad)
    # Change of the step by each error: distance [m] and rotation [rad].
    steps = ((travel_m, 0.0), (0.0, turn_rad), (0.25 * (right_m - left_m), travel_m / wheel_separation_m))
    carried = []
    for (x_m, y_m, error_rad), (along_m, by_rad) in zip(errors, steps):
        across_m = travel_m * (error_rad + 0.5 * by_rad)
        new_x_m, new_y_m = x_m + cos_yaw * along_m - sin_yaw * across_m, y_m + sin_yaw * along_m + cos_yaw * across_m
        carried.append((new_x_m, new_y_m, error_rad + by_rad))
    return tuple(carried)


def geometry_covariance(errors: Columns, std: GeometryStd) -> PlanarCovariance:
    """Return the covariance of independent geometry errors with these standard deviations."""
    covariance = PlanarCovariance()
    for (x, y, yaw), spread in zip(errors, std):
        if spread:
            of_x, of_y, of_yaw = spread**2 * x, spread**2 * y, spread**2 * yaw
            covariance = covariance.plus(
                PlanarCovariance(of_x * x, of_x * y, of_x * yaw, of_y * y, of_y * yaw, of_yaw * yaw)
            )
    return covariance


# Low-pass time constant [s]: suppresses the speed jumps of single pulses of a coarse encoder.
SMOOTHED_OVER_S = 0.2


class LateralAcceleration:
    """Centripetal acceleration from the low-passed speeds of both wheels."""

    def __init__(self, wheel_separation_m: float) -> None:
        self._wheel_separation_m = wheel_separation_m
        self._left_mps = self._right_mps = 0.0

    def take(self, interval_s: float, left_m: float, right_m: float) -> float:
        """Add the travel of both wheels in an interval, and return the acceleration to the left [m/s^2].

        It is v w, linear times angular velocity: 0 for straight motion and turns in place.
        """
        spread_over_s = SMOOTHED_OVER_S + interval_s
        self._left_mps += (left_m - self._left_mps * interval_s) / spread_over_s
        self._right_mps += (right_m - self._right_mps * interval_s) / spread_over_s
        return (self._right_mps**2 - self._left_mps**2) / (2.0 * self._wheel_separation_m)
