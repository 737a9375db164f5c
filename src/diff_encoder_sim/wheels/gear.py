"""The gear between motor and wheel, and play in general."""

from __future__ import annotations

from typing import Optional

import numpy as np


class Play:
    """Follows what moves it once a gap is taken up: its output lags by half of the gap."""

    def __init__(self, gap: float, place: float) -> None:
        """Begin at `place`, at most half a gap from the first input."""
        self._half, self._place = 0.5 * gap, place

    def follow(self, moved_to: float) -> float:
        """Move the input, and return the output."""
        if moved_to - self._place > self._half:
            self._place = moved_to - self._half
        elif self._place - moved_to > self._half:
            self._place = moved_to + self._half
        return self._place


class Gear:
    """Turns the wheel's angle into that of the shaft with the sensor.

    The motor drives the wheel, so it is ahead by half of the play in the direction of motion, and crosses all of it
    while the wheel turns back by as much.
    """

    def __init__(self, ratio: float, backlash_rad: float, rng: np.random.Generator) -> None:
        """Draw where in the play the gear begins."""
        self._ratio, self._backlash_rad = ratio, backlash_rad
        self.begins_rad: float = rng.uniform(-0.5, 0.5) * backlash_rad  # the wheel's angle less that of its play
        self._play: Optional[Play] = None

    def shaft_angle_rad(self, wheel_angle_rad: float) -> float:
        """Turn the wheel."""
        if not self._backlash_rad:
            return self._ratio * wheel_angle_rad
        if self._play is None:
            self._play = Play(self._backlash_rad, wheel_angle_rad + self.begins_rad)
        return self._ratio * (2.0 * wheel_angle_rad - self._play.follow(wheel_angle_rad))
