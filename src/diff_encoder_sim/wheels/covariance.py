"""The covariance of wheel odometry: motion noise, quantisation, and uncertain geometry."""

from __future__ import annotations

import math
import operator
from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D

# Variance of a position that is uniform within one pulse, in pulses squared.
PULSE_VARIANCE = 1.0 / 12.0


def reading_variance(m_per_pulse: float, of_sensor: float = 0.0) -> float:
    """Return the variance [m^2] of a wheel's travel in one reading; `of_sensor` is added to rounding [pulses^2]."""
    return (PULSE_VARIANCE + of_sensor) * m_per_pulse**2


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
) -> PlanarCovariance:
    """Return the covariance after one more step of both wheels.

    The travels have independent variances in proportion to their lengths (Siegwart and Nourbakhsh, Introduction to
    Autonomous Mobile Robots, section 5.2.4).

    Args:
        covariance: before the step.
        yaw_rad: heading before the step.
        left_m: travel of the left wheel.
        right_m: travel of the right wheel.
        wheel_separation_m: between the contact points.
        motion_noise: variance per metre of travel [m^2/m].
    """
    travel_m = 0.5 * (left_m + right_m)
    mid_yaw_rad = yaw_rad + 0.5 * (right_m - left_m) / wheel_separation_m
    cos_yaw, sin_yaw = math.cos(mid_yaw_rad), math.sin(mid_yaw_rad)
    # The Jacobian's columns: a metre of the left wheel adds (a - b, -turn) to the pose, one of the right (a + b, turn).
    turn, lever = 1.0 / wheel_separation_m, 0.5 * travel_m / wheel_separation_m
    ax, ay, bx, by = 0.5 * cos_yaw, 0.5 * sin_yaw, -lever * sin_yaw, lever * cos_yaw
    left_m2, right_m2 = motion_noise * abs(left_m), motion_noise * abs(right_m)
    both_m2, more_m2 = left_m2 + right_m2, right_m2 - left_m2
    xx, xy, x_yaw, yy, y_yaw, yaw_yaw = covariance.carried_by_heading(-travel_m * sin_yaw, travel_m * cos_yaw)
    return PlanarCovariance(
        xx + both_m2 * (ax * ax + bx * bx) + 2.0 * more_m2 * ax * bx,
        xy + both_m2 * (ax * ay + bx * by) + more_m2 * (ax * by + bx * ay),
        x_yaw + turn * (more_m2 * ax + both_m2 * bx),
        yy + both_m2 * (ay * ay + by * by) + 2.0 * more_m2 * ay * by,
        y_yaw + turn * (more_m2 * ay + both_m2 * by),
        yaw_yaw + turn * turn * both_m2,
    )


class Remainder:
    """The travel of a wheel that is not counted yet, 0 to 1 pulse, and what it does to the position under way.

    The derivation is in docs/adr/0002-odometry-covariance.md: a metre of remainder while the other wheel travels
    `way_m` shifts the robot by way_m / L across the heading. After K reports from count to count, the remainder in
    report k was (k + 1/2) / K +- 1/2 / K pulses if the wheel turned steadily, otherwise 1/2 +- 1/2.
    """

    def __init__(self, m_per_pulse: float, reading_var_m2: float) -> None:
        self.reading_var_m2 = reading_var_m2
        self._m_per_pulse, self._edge_var_m2 = m_per_pulse, reading_var_m2 - reading_variance(m_per_pulse)
        self._reports = 0  # since the last count
        self._reports_before = 0  # between the last two counts, negative if backward; 0: fewer than two
        # Shift per metre of remainder since the last count, and the same times the report's number.
        self._x = self._y = self._x_reports = self._y_reports = 0.0
        self.known_x_m = self.known_y_m = 0.0  # shift by steady remainders
        self.xx = self.xy = self.yy = 0.0  # covariance of the other shifts [m^2]

    def step(self, pulses: int, x: float, y: float) -> None:
        """Process a report: its pulses, and the shift per metre of remainder, half before and half after it."""
        self._reports += 1
        if not pulses:
            if self._reports == 1:
                self._x_reports, self._y_reports = 0.5 * self._x, 0.5 * self._y
            self._x, self._x_reports = self._x + x, self._x_reports + self._reports * x
            self._y, self._y_reports = self._y + y, self._y_reports + self._reports * y
            return
        reports, half_x, half_y = self._reports if pulses > 0 else -self._reports, 0.5 * x, 0.5 * y
        sum_x, sum_y, variance_m2 = self._x + half_x, self._y + half_y, self.reading_var_m2
        # From count to count of a steady wheel it is K or K + 1 reports.
        if self._reports > 1 and abs(reports - self._reports_before) <= 1:
            mean_report, sign = self._reports - 0.5, math.copysign(0.5, reports)
            self.known_x_m += self._m_per_pulse * ((self._x_reports + mean_report * half_x) / reports - sign * sum_x)
            self.known_y_m += self._m_per_pulse * ((self._y_reports + mean_report * half_y) / reports - sign * sum_y)
            variance_m2 = self._edge_var_m2 + reading_variance(self._m_per_pulse / reports)
        self.xx += variance_m2 * sum_x * sum_x
        self.xy += variance_m2 * sum_x * sum_y
        self.yy += variance_m2 * sum_y * sum_y
        self._x, self._y, self._reports, self._reports_before = half_x, half_y, 0, reports

    def now(self, half_cos: float, half_sin: float) -> Tuple[float, float]:
        """Return x and y by which a metre of the current remainder moves the robot: half of it along the heading."""
        before = abs(self._reports_before)
        pulses = 1.0 / before if before and self._reports <= before + 1 else 1.0
        return half_cos - pulses * self._x, half_sin - pulses * self._y


def quantisation_covariance(
    base_pose_in_odom: Pose2D, left: Remainder, right: Remainder, wheel_separation_m: float
) -> PlanarCovariance:
    """Return the covariance of rounding to whole pulses: bounded, not a random walk.

    Each wheel has a uniform rounding error at the start and now. The error at the start rotates and shifts the whole
    path about the start; the current error rotates and shifts the robot in place. The errors in between shift it.
    After a straight line of length S the lateral spread is (S d/L) sqrt(1/6); the heading spread is always
    (d/L) sqrt(1/3) (docs/adr/0002-odometry-covariance.md).

    Args:
        base_pose_in_odom: now.
        left: of the left wheel, after the drive; a new one leaves out the errors under way.
        right: of the right wheel.
        wheel_separation_m: between the contact points.
    """
    x_m, y_m, yaw_rad = base_pose_in_odom
    half_cos, half_sin = 0.5 * math.cos(yaw_rad), 0.5 * math.sin(yaw_rad)
    turn, x_turns, y_turns = 1.0 / wheel_separation_m, x_m / wheel_separation_m, y_m / wheel_separation_m
    left_m2, right_m2 = left.reading_var_m2, right.reading_var_m2
    # A metre of the left wheel at the start moves the pose by (1/2 + y/L, -x/L, -1/L), of the right one by
    # (1/2 - y/L, x/L, 1/L); of either now by its `now` and -1/L or 1/L.
    left_start, right_start, both_m2 = 0.5 + y_turns, 0.5 - y_turns, left_m2 + right_m2
    along = right_m2 * right_start - left_m2 * left_start
    (left_x, left_y), (right_x, right_y) = left.now(half_cos, half_sin), right.now(half_cos, half_sin)
    left_x_m2, right_x_m2 = left_m2 * left_x, right_m2 * right_x
    left_y_m2, right_y_m2 = left_m2 * left_y, right_m2 * right_y
    known_x_m, known_y_m = left.known_x_m + right.known_x_m, left.known_y_m + right.known_y_m
    xx = left.xx + right.xx + known_x_m * known_x_m
    xy = left.xy + right.xy + known_x_m * known_y_m
    yy = left.yy + right.yy + known_y_m * known_y_m
    return PlanarCovariance(
        xx + left_m2 * left_start**2 + right_m2 * right_start**2 + left_x_m2 * left_x + right_x_m2 * right_x,
        xy + along * x_turns + left_x_m2 * left_y + right_x_m2 * right_y,
        (along + right_x_m2 - left_x_m2) * turn,
        yy + both_m2 * x_turns**2 + left_y_m2 * left_y + right_y_m2 * right_y,
        (both_m2 * x_turns + right_y_m2 - left_y_m2) * turn,
        2.0 * both_m2 * turn**2,
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
