"""Wheel angles from the recorded counts of an encoder."""

from __future__ import annotations

import math
from typing import Optional, Tuple

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.stamps import Step, Timeline
from diff_encoder_sim.drives.sensor_messages import JointValues
from diff_encoder_sim.wheels.encoder_params import count_difference
from diff_encoder_sim.wheels.odometry import CounterSteps, Reading
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
        self._steps = CounterSteps(odometry)
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
