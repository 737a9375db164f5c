"""Wheel angles from the recorded counts of an encoder."""

from __future__ import annotations

import math
from typing import Dict, Tuple

from diff_encoder_sim.encoders.counter import count_difference
from diff_encoder_sim.encoders.pulses import PerWheel
from diff_encoder_sim.serialization.joint_messages import JointValues


class CountedAngles:
    """Takes the middle of the pulse that a wheel is in for its angle.

    At a PPR that divides this encoder's, equation (1) then gives the very counts. At another PPR,
    a count is one off in a quarter of PPR / this encoder's PPR of the samples.
    """

    def __init__(self, joints: Tuple[str, str], ppr: PerWheel, counter_modulus: int) -> None:
        """Prepare for `joints` left, right; their counts wrap at `counter_modulus` unless 0."""
        self._rad_per_pulse = {joints[0]: 2.0 * math.pi / ppr.left, joints[1]: 2.0 * math.pi / ppr.right}
        self._modulus = counter_modulus
        self._recorded: Dict[str, int] = {}  # by joint: the last count
        self._totals: Dict[str, int] = {}  # by joint: unwrapped

    def angles(self, counts: JointValues) -> JointValues:
        """Replace counts by angles [rad], and leave out joints that are no wheels."""
        wheels = [(name, int(count)) for name, count in zip(counts.names, counts.values) if name in self._rad_per_pulse]
        angles_rad = [self._angle_rad(name, count) for name, count in wheels]
        return counts._replace(names=tuple(name for name, _ in wheels), values=angles_rad)

    def _angle_rad(self, joint: str, count: int) -> float:
        last = self._recorded.get(joint)
        total = count if last is None else self._totals[joint] + count_difference(count, last, self._modulus)
        self._recorded[joint], self._totals[joint] = count, total
        return (total + 0.5) * self._rad_per_pulse[joint]
