"""Scripted drives: velocity profiles over time that cover a distance exactly, without feedback."""

from __future__ import annotations

import bisect
import math
from typing import Callable, List, NamedTuple, Tuple

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.navigation.navigator_inputs import Command
from diff_encoder_sim.simulation.state import STATES_PERIOD_S

PAUSE_BETWEEN_SEGMENTS_S = 0.5
SETTLING_S = 1.0  # at rest, before a trial ends


class Trapezoid(NamedTuple):
    """Speed up, cruise, slow down: from rest to rest over a signed distance [m or rad]."""

    distance: float
    top_speed: float  # reached or not, > 0
    acceleration: float  # and deceleration, > 0

    @property
    def ramp_s(self) -> float:
        """Return the time to speed up, which is also that to slow down."""
        return min(self.top_speed / self.acceleration, math.sqrt(abs(self.distance) / self.acceleration))

    @property
    def duration_s(self) -> float:
        """Return the time from rest to rest: only two ramps if the top speed is not reached."""
        return self.ramp_s + max(self.ramp_s, abs(self.distance) / self.top_speed)

    def covered(self, time_s: float) -> float:
        """Return the distance covered after `time_s`, in closed form."""
        left_s = self.duration_s - time_s
        if time_s <= 0.0:
            covered = 0.0
        elif left_s <= 0.0:
            covered = abs(self.distance)
        elif time_s < self.ramp_s:
            covered = 0.5 * self.acceleration * time_s**2
        elif left_s < self.ramp_s:
            covered = abs(self.distance) - 0.5 * self.acceleration * left_s**2
        else:
            covered = self.acceleration * self.ramp_s * (time_s - 0.5 * self.ramp_s)
        return math.copysign(covered, self.distance)


class ScriptedDrive:
    """A test's consecutive segments, as velocity commands over time."""

    def __init__(self, test: TestDefinition) -> None:
        self._starts_s: List[float] = []
        self._legs: List[Tuple[Trapezoid, float, float]] = []  # profile, and motion per unit of it: [m], [rad]
        start_s, limits = 0.0, test.limits
        for segment in test.drive:
            distance_m, turn_rad = segment.motion
            if turn_rad:
                radius_m = distance_m / turn_rad
                # The linear motion of an arc may be what is limited.
                speed = limits.angular_speed / max(1.0, abs(radius_m) * limits.angular_speed / limits.speed)
                most = max(1.0, abs(radius_m) * limits.angular_acceleration / limits.acceleration)
                leg = Trapezoid(turn_rad, speed, limits.angular_acceleration / most), radius_m, 1.0
            else:
                leg = Trapezoid(distance_m, limits.speed, limits.acceleration), 1.0, 0.0
            self._starts_s.append(start_s)
            self._legs.append(leg)
            start_s += leg[0].duration_s + (segment.stop or 0.0) + PAUSE_BETWEEN_SEGMENTS_S
        self.duration_s = start_s

    def is_over(self, elapsed_s: float) -> bool:
        """Return whether the robot has been at rest for SETTLING_S."""
        return elapsed_s > self.duration_s + SETTLING_S

    def command_at(self, from_s: float, period_s: float = STATES_PERIOD_S) -> Tuple[float, float]:
        """Return the mean linear [m/s] and angular [rad/s] velocity in a period that begins at a time since the start.

        A command holds until the next one; its mean over that time makes the commands add up to the exact distance.
        """
        to_s = from_s + period_s
        linear_m = angular_rad = 0.0
        # Only the current segments: long drives have thousands.
        first = max(0, bisect.bisect(self._starts_s, from_s) - 1)
        for index in range(first, bisect.bisect(self._starts_s, to_s)):
            start_s, (profile, metres, radians) = self._starts_s[index], self._legs[index]
            covered = profile.covered(to_s - start_s) - profile.covered(from_s - start_s)
            linear_m += metres * covered
            angular_rad += radians * covered
        return linear_m / (to_s - from_s), angular_rad / (to_s - from_s)


class ScriptedDriver:
    """Drives by time only."""

    def __init__(self, trial: Trial, send: Callable[[int, Command, bool], None]) -> None:
        self._drive, self._send = ScriptedDrive(trial.test), send
        self.is_over = False

    def take_time(self, now_ns: int) -> None:
        """Send the command for the period that begins."""
        elapsed_s = now_ns / NANOSECONDS_PER_SECOND
        self._send(now_ns, Command(*self._drive.command_at(elapsed_s)), False)
        self.is_over = self._drive.is_over(elapsed_s)
