"""Wheel angles from the recorded counts of an encoder."""

from __future__ import annotations

import math
from typing import Optional, Tuple

from diff_encoder_sim.encoders.counter import count_difference
from diff_encoder_sim.encoders.pulses import PerWheel
from diff_encoder_sim.serialization.joint_messages import JointValues


class CountedWheel:
    """Takes the middle of the pulse that a wheel is in for its angle.

    At a PPR that divides this encoder's, equation (1) then gives the very counts. At another PPR,
    a count is one off in a quarter of PPR / this encoder's PPR of the samples.
    """

    def __init__(self, ppr: float, counter_modulus: int) -> None:
        """Prepare for counts that wrap at `counter_modulus` unless 0."""
        self._rad_per_pulse = 2.0 * math.pi / ppr
        self._modulus = counter_modulus
        self._last: Optional[int] = None
        self._total = 0  # unwrapped

    def angle_rad(self, count: int) -> float:
        """Take the next count."""
        self._total = count if self._last is None else self._total + count_difference(count, self._last, self._modulus)
        self._last = count
        return (self._total + 0.5) * self._rad_per_pulse


class CountedAngles:
    """Replaces the counts of both wheels in joint messages by angles."""

    def __init__(self, joints: Tuple[str, str], ppr: PerWheel, counter_modulus: int) -> None:
        """Prepare for `joints` left, right."""
        self._wheels = {
            joints[0]: CountedWheel(ppr.left, counter_modulus),
            joints[1]: CountedWheel(ppr.right, counter_modulus),
        }

    def angles(self, counts: JointValues) -> JointValues:
        """Replace counts by angles [rad], and leave out joints that are no wheels."""
        wheels = [(name, int(count)) for name, count in zip(counts.names, counts.values) if name in self._wheels]
        angles_rad = [self._wheels[name].angle_rad(count) for name, count in wheels]
        return counts._replace(names=tuple(name for name, _ in wheels), values=angles_rad)
