"""The covariance of wheel odometry: motion noise, quantisation, and uncertain geometry."""

from __future__ import annotations

import cmath
import math
import operator
from typing import List, NamedTuple, Optional, Tuple

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
    before: PlanarCovariance, yaw_rad: float, left_m: float, right_m: float, wheel_separation_m: float, noise: float
) -> PlanarCovariance:
    """Return the covariance after one more step of both wheels, of the one `before` it at the heading `yaw_rad`.

    The travels have independent variances, `noise` [m^2/m] times their lengths (Siegwart and Nourbakhsh,
    Introduction to Autonomous Mobile Robots, section 5.2.4).
    """
    travel_m = 0.5 * (left_m + right_m)
    mid_yaw_rad = yaw_rad + 0.5 * (right_m - left_m) / wheel_separation_m
    cos_yaw, sin_yaw = math.cos(mid_yaw_rad), math.sin(mid_yaw_rad)
    # The Jacobian's columns: a metre of the left wheel adds (a - b, -turn) to the pose, one of the right (a + b, turn).
    turn, lever = 1.0 / wheel_separation_m, 0.5 * travel_m / wheel_separation_m
    ax, ay, bx, by = 0.5 * cos_yaw, 0.5 * sin_yaw, -lever * sin_yaw, lever * cos_yaw
    left_m2, right_m2 = noise * abs(left_m), noise * abs(right_m)
    both_m2, more_m2 = left_m2 + right_m2, right_m2 - left_m2
    xx, xy, x_yaw, yy, y_yaw, yaw_yaw = before.carried_by_heading(-travel_m * sin_yaw, travel_m * cos_yaw)
    return PlanarCovariance(
        xx + both_m2 * (ax * ax + bx * bx) + 2.0 * more_m2 * ax * bx,
        xy + both_m2 * (ax * ay + bx * by) + more_m2 * (ax * by + bx * ay),
        x_yaw + turn * (more_m2 * ax + both_m2 * bx),
        yy + both_m2 * (ay * ay + by * by) + 2.0 * more_m2 * ay * by,
        y_yaw + turn * (more_m2 * ay + both_m2 * by),
        yaw_yaw + turn * turn * both_m2,
    )


class SteadySpeed:
    """The speeds of a wheel, in pulses per report, that agree with its counts since it last changed its speed.

    A wheel of one speed v counts less than one pulse more or less than v (k - j) between any two reports j and k. Only
    corners of the convex hull of all counts bound v. If no speed is left, the wheel has changed its speed.
    """

    def __init__(self) -> None:
        self._reports = self._total = self._quiet = 0  # quiet: reports since the last count
        self._above: List[Tuple[int, int]] = [(0, 0)]  # corners (report, total) of the hull
        self._below: List[Tuple[int, int]] = [(0, 0)]
        self._low, self._high = -math.inf, math.inf

    def step(self, pulses: int) -> Tuple[float, float]:
        """Process a report; return the middle and the width of the speeds: both 0 of a wheel that may stand."""
        here = self._reports + 1, self._total + pulses
        self._quiet = 0 if pulses else self._quiet + 1
        low = max(self._low, *((here[1] - total - 1) / (here[0] - report) for report, total in self._below))
        high = min(self._high, *((here[1] - total + 1) / (here[0] - report) for report, total in self._above))
        if low >= high:
            self._above, self._below = [(self._reports, self._total)], [(self._reports, self._total)]
            low, high = (pulses - 1.0, pulses + 1.0) if pulses else (-1.0 / self._quiet, 1.0 / self._quiet)
        for hull, sign in ((self._above, 1), (self._below, -1)):
            while len(hull) > 1 and sign * _turn(hull[-2], hull[-1], here) >= 0:
                hull.pop()
            hull.append(here)
        self._reports, self._total, self._low, self._high = *here, low, high
        return (0.0, 0.0) if not pulses and low <= 0.0 <= high else (0.5 * (low + high), high - low)


def _turn(first: Tuple[int, int], second: Tuple[int, int], third: Tuple[int, int]) -> int:
    """Return a number that is positive if the way by three points turns to the left."""
    return (second[0] - first[0]) * (third[1] - first[1]) - (second[1] - first[1]) * (third[0] - first[0])


# Variance of a remainder [pulses^2] by harmonics of a pulse: harmonic m makes 1 / (2 pi^2 m^2); the last one has the
# variance of those above it, too.
_FIRST = [0.5 / (math.pi * harmonic) ** 2 for harmonic in (1, 2, 3)]
VARIANCES = (*_FIRST, PULSE_VARIANCE - sum(_FIRST))


class Remainder:
    """What the remainder of a wheel, 0 to 1 pulse that is not counted yet, did to the position under way.

    A metre of remainder while the other wheel travels `way_m` shifts the robot by way_m / L across the heading. The
    remainder is a sawtooth of the wheel's angle: its harmonic m turns by m times the speed in pulses per report. So do
    sums of the shifts by harmonics, which fade as far as that speed is not known
    (docs/adr/0002-odometry-covariance.md).
    """

    def __init__(self) -> None:
        self._speed = SteadySpeed()
        self._sums = [(0j, 0j)] * len(VARIANCES)  # of x and y, by harmonic
        self._x = self._y = 0.0  # covariance of the shift so far with the current remainder [pulses^2]
        self._now_x = self._now_y = 0.0  # shift per metre of the current remainder so far
        self._xx = self._xy = self._yy = 0.0  # covariance of the shift by the remainders before it [pulses^2]

    def step(self, pulses: int, x: float, y: float) -> None:
        """Process a report: its pulses, and the shift per metre of remainder."""
        # Half of the shift is by the remainder before the report, and half by the one after it.
        now_x, now_y = self._now_x, self._now_y = self._now_x + 0.5 * x, self._now_y + 0.5 * y
        (self._xx, self._xy, self._yy), _ = self.moments()
        middle, width = self._speed.step(pulses)
        # The mean turn of a normal speed with the variance of a triangle, that of a difference of two remainders.
        turned, faded = cmath.exp(-2j * math.pi * middle), math.exp(-((math.pi * width) ** 2) / 12.0)
        factors = [turned**harmonic * faded ** (harmonic * harmonic) for harmonic in range(1, len(VARIANCES) + 1)]
        self._sums = [((of_x + now_x) * by, (of_y + now_y) * by) for (of_x, of_y), by in zip(self._sums, factors)]
        self._x = sum(variance * of_x.real for variance, (of_x, _) in zip(VARIANCES, self._sums))
        self._y = sum(variance * of_y.real for variance, (_, of_y) in zip(VARIANCES, self._sums))
        self._now_x, self._now_y = 0.5 * x, 0.5 * y

    def moments(self) -> Tuple[Tuple[float, float, float], Tuple[float, float]]:
        """Return xx, xy and yy of the shift, and its x and y with the current remainder [pulses^2]."""
        x, y, now_x, now_y = self._x, self._y, self._now_x, self._now_y
        with_x, with_y = x + PULSE_VARIANCE * now_x, y + PULSE_VARIANCE * now_y
        shift = self._xx + now_x * (x + with_x), self._xy + now_x * y + now_y * with_x, self._yy + now_y * (y + with_y)
        return shift, (with_x, with_y)


def quantisation_covariance(
    base_pose_in_odom: Pose2D,
    reading_variances_m2: Tuple[float, float],
    wheel_separation_m: float,
    remainders: Optional[Tuple[Remainder, Remainder]] = None,
) -> PlanarCovariance:
    """Return the covariance of rounding to whole pulses: bounded, not a random walk.

    Each wheel has a uniform rounding error at the start and now. The error at the start rotates and shifts the whole
    path about the start; the current error rotates and shifts the robot in place. The errors in between shift it.
    After a straight line of length S the lateral spread is (S d/L) sqrt(1/6); the heading spread is always
    (d/L) sqrt(1/3) (docs/adr/0002-odometry-covariance.md).

    Args:
        base_pose_in_odom: now.
        reading_variances_m2: of the left and the right wheel.
        wheel_separation_m: between the contact points.
        remainders: of the left and the right wheel, after the drive; None leaves out the errors under way.
    """
    x_m, y_m, yaw_rad = base_pose_in_odom
    half_cos, half_sin = 0.5 * math.cos(yaw_rad), 0.5 * math.sin(yaw_rad)
    turn, x_turns, y_turns = 1.0 / wheel_separation_m, x_m / wheel_separation_m, y_m / wheel_separation_m
    left_m2, right_m2 = reading_variances_m2
    # A metre of the left wheel at the start moves the pose by (1/2 + y/L, -x/L, -1/L), of the right one by
    # (1/2 - y/L, x/L, 1/L); of either now by (cos/2, sin/2) and -1/L or 1/L.
    left_start, right_start, both_m2 = 0.5 + y_turns, 0.5 - y_turns, left_m2 + right_m2
    along, more_m2 = right_m2 * right_start - left_m2 * left_start, right_m2 - left_m2
    covariance = PlanarCovariance(
        left_m2 * left_start**2 + right_m2 * right_start**2 + both_m2 * half_cos**2,
        along * x_turns + both_m2 * half_cos * half_sin,
        (along + more_m2 * half_cos) * turn,
        both_m2 * (x_turns**2 + half_sin**2),
        (both_m2 * x_turns + more_m2 * half_sin) * turn,
        2.0 * both_m2 * turn**2,
    )
    for remainder, variance_m2, by_wheel in zip(remainders or (), reading_variances_m2, (-turn, turn)):
        scale = variance_m2 / PULSE_VARIANCE
        (xx, xy, yy), (x, y) = remainder.moments()
        covariance = covariance.plus(
            PlanarCovariance(
                scale * (xx + 2.0 * half_cos * x),
                scale * (xy + half_cos * y + half_sin * x),
                scale * by_wheel * x,
                scale * (yy + 2.0 * half_sin * y),
                scale * by_wheel * y,
            )
        )
    return covariance


class GeometryStd(NamedTuple):
    """Standard deviations of the relative errors of the assumed geometry."""

    distance: float = 0.0
    turn: float = 0.0
    diameter_difference: float = 0.0  # right minus left, of their mean


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
