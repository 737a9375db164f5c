"""The units of numbers that were recorded of a wheel, and of times. For command lines: it imports next to nothing."""

from __future__ import annotations

import math
from typing import Callable, Dict

TIME_UNITS = {'s': 10**9, 'ms': 10**6, 'us': 10**3, 'ns': 1}  # in nanoseconds

TICKS = 'ticks'
TICKS_PER_MESSAGE = 'ticks/message'

# What one of each turns a wheel by, given its radius [m].
RAD_OF_ANGLE: Dict[str, Callable[[float], float]] = {
    'rad': lambda _: 1.0,
    'deg': lambda _: math.pi / 180.0,
    'rev': lambda _: 2.0 * math.pi,
    'm': lambda radius_m: 1.0 / radius_m,
}
RADPS_OF_SPEED: Dict[str, Callable[[float], float]] = {
    'rad/s': lambda _: 1.0,
    'deg/s': lambda _: math.pi / 180.0,
    'rpm': lambda _: math.pi / 30.0,
    'm/s': lambda radius_m: 1.0 / radius_m,
}
COUNTED = (TICKS, TICKS_PER_MESSAGE)
SPEEDS = tuple(RADPS_OF_SPEED)
UNITS = (*COUNTED, *RAD_OF_ANGLE, *SPEEDS)
