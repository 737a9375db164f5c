"""The units of numbers that were recorded of a wheel, and of times. For command lines: it imports next to nothing."""

import math

TIME_UNITS = {'s': 10**9, 'ms': 10**6, 'us': 10**3, 'ns': 1}  # in nanoseconds

TICKS = 'ticks'
TICKS_PER_MESSAGE = 'ticks/message'
COUNTED = (TICKS, TICKS_PER_MESSAGE)

# What one of each turns a wheel by; m and m/s are divided by its radius.
RAD_OF_ANGLE = {'rad': 1.0, 'deg': math.pi / 180.0, 'rev': 2.0 * math.pi, 'm': 1.0}
RADPS_OF_SPEED = {'rad/s': 1.0, 'deg/s': math.pi / 180.0, 'rpm': math.pi / 30.0, 'm/s': 1.0}
UNITS = (*COUNTED, *RAD_OF_ANGLE, *RADPS_OF_SPEED)

# Of the poses in a table: in metres, in radians.
LENGTH_UNITS = {'m': 1.0, 'cm': 0.01, 'mm': 0.001}
ANGLE_UNITS = {'rad': 1.0, 'deg': math.pi / 180.0}
