"""What a recorded number says of a wheel, by its unit: counts, an angle, a path, or a speed; each becomes an angle."""

from __future__ import annotations

import math
from typing import Callable, NamedTuple, Optional

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.counted_angles import CountedWheel
from diff_encoder_sim.drives.number_units import RAD_OF_ANGLE, RADPS_OF_SPEED, SPEEDS, TICKS

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
