"""What recorded numbers of a wheel mean: counts, angles, distances or speeds, and the wheel angles that follow."""

from __future__ import annotations

import math
from typing import Callable, NamedTuple, Optional, Tuple

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step, Timeline
from diff_encoder_sim.drives.number_units import RAD_OF_ANGLE, RADPS_OF_SPEED, SPEEDS, TICKS
from diff_encoder_sim.drives.sensor_messages import JointValues
from diff_encoder_sim.wheels.counter import CounterSteps, Reading, count_difference
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.report_link import LATE_REPORT_TOLERANCE_NS


def angle_of_count_rad(count: int, ppr: float) -> float:
    """Return the middle of the pulse that a wheel is in.

    At a PPR that divides this encoder's, equation (1) then gives the very counts. At another PPR,
    a count is one off in a quarter of PPR / this encoder's PPR of the samples.
    """
    return (count + 0.5) * (2.0 * math.pi / ppr)


class CountedWheel:
    """Turns the counts of one wheel into angles."""

    def __init__(self, ppr: float, counter_modulus: int) -> None:
        """Prepare for counts that wrap at `counter_modulus` unless 0."""
        self._ppr, self._modulus = ppr, counter_modulus
        self._last: Optional[int] = None
        self._total = 0  # unwrapped

    def angle_rad(self, count: int) -> float:
        """Take the next count."""
        self._total = count if self._last is None else self._total + count_difference(count, self._last, self._modulus)
        self._last = count
        return angle_of_count_rad(self._total, self._ppr)


class CountedAngles:
    """Replaces the counts of both wheels in joint messages by angles, across wraps and restarts of the counters."""

    def __init__(self, joints: Tuple[str, str], odometry: OdometryParams) -> None:
        """Prepare for `joints` left, right, whose counts the `odometry` could be fed with."""
        self._joints, self._ppr = joints, odometry.counts_per_turn
        self._timeline = Timeline(LATE_REPORT_TOLERANCE_NS)
        self._steps = CounterSteps(odometry.counter_limits)
        self._totals = 0, 0  # unwrapped: left, right
        self.restarts = 0  # of the counters

    def angles(self, counts: JointValues) -> JointValues:
        """Replace counts by angles [rad], and leave out joints that are no wheels.

        Raises:
            InputFault: a wheel is missing or named twice.
        """
        left, right = self._counts(counts)
        step = self._timeline.advance(counts.stamp_ns)
        if step is Step.RESTART:
            self._steps.reset()
        if step is not Step.STALE:
            self._take(Reading(counts.stamp_ns, left, right))
        left, right = self._totals
        angles_rad = [angle_of_count_rad(left, self._ppr.left), angle_of_count_rad(right, self._ppr.right)]
        return counts._replace(names=self._joints, values=angles_rad)

    def _counts(self, counts: JointValues) -> Tuple[int, int]:
        by_name = dict(zip(counts.names, counts.values))
        for joint in self._joints:
            if joint not in by_name or counts.names.count(joint) > 1:
                raise InputFault(f'names {list(counts.names)}; expected {" and ".join(self._joints)}, each once')
        left, right = (int(by_name[joint]) for joint in self._joints)
        return left, right

    def _take(self, reading: Reading) -> None:
        step = self._steps.take(reading)
        if step is None:
            self._totals = reading.left_pulses, reading.right_pulses
            return
        left, right = self._totals
        self._totals = left + step.left_pulses, right + step.right_pulses
        self.restarts += bool(step.restart)


SPEEDS_NOTE = (
    'the wheel angles are integrated speeds: what a wheel does between two of them, and the error of each, adds up in '
    'them; a PPR adds its own rounding'
)


class WheelUnit(NamedTuple):
    """How the numbers of one wheel are to be understood."""

    unit: str  # one of UNITS
    radius_m: float
    ppr: Optional[float] = None  # of counts
    counter_modulus: int = 0  # of counts; 0 where they do not wrap
    is_reversed: bool = False  # they fall when the robot drives forward
    start_rad: float = 0.0  # angle at the first speed


class WheelAngle:
    """Turns the numbers of one wheel, in their order, into angles [rad]."""

    def __init__(self, unit: WheelUnit) -> None:
        self._sign = -1.0 if unit.is_reversed else 1.0
        self._convert = _converter(unit)

    def angle_rad(self, stamp_ns: int, value: float) -> float:
        """Take the next number, which is finite."""
        return self._sign * self._convert(stamp_ns, value)


def _converter(unit: WheelUnit) -> Callable[[int, float], float]:
    if unit.ppr is not None:
        wheel = CountedWheel(unit.ppr, unit.counter_modulus)
        if unit.unit == TICKS:
            return lambda _, count: wheel.angle_rad(math.floor(count))
        total = _Total()
        return lambda _, ticks: wheel.angle_rad(math.floor(total.add(ticks)))
    if unit.unit in SPEEDS:
        integral = _Integral(RADPS_OF_SPEED[unit.unit](unit.radius_m), unit.start_rad)
        return integral.add
    factor = RAD_OF_ANGLE[unit.unit](unit.radius_m)
    return lambda _, value: factor * value


class _Total:
    def __init__(self) -> None:
        self._total = 0.0

    def add(self, value: float) -> float:
        self._total += value
        return self._total


class _Integral:
    """Integrates a speed by the trapezoidal rule."""

    def __init__(self, factor: float, start_rad: float) -> None:
        self._factor = factor
        self._angle_rad = start_rad
        self._last_ns: Optional[int] = None
        self._last_radps = 0.0

    def add(self, stamp_ns: int, speed: float) -> float:
        speed_radps = self._factor * speed
        # Time that goes back is the start of another run, which the encoder sees, too.
        if self._last_ns is not None and stamp_ns > self._last_ns:
            interval_s = (stamp_ns - self._last_ns) / NANOSECONDS_PER_SECOND
            self._angle_rad += 0.5 * (speed_radps + self._last_radps) * interval_s
        self._last_ns, self._last_radps = stamp_ns, speed_radps
        return self._angle_rad
