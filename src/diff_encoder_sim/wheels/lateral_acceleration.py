"""How hard a robot is pulled sideways, by what its wheels travel: in curves, where wheels lose grip."""

from __future__ import annotations

# A pulse is a jump of speed: over so long it counts little in a coarse encoder's straight line [s].
SMOOTHED_OVER_S = 0.2


class LateralAcceleration:
    """The acceleration towards the middle of the curve, by the low-passed speeds of both wheels."""

    def __init__(self, wheel_separation_m: float) -> None:
        self._wheel_separation_m = wheel_separation_m
        self.reset()

    def reset(self) -> None:
        """Stand still."""
        self._left_mps = self._right_mps = 0.0

    def take(self, interval_s: float, left_m: float, right_m: float) -> float:
        """Take what both wheels travelled in an interval, and return the acceleration [m/s^2], to the left.

        It is v w, forward speed times turning speed: none straight ahead and in place.
        """
        spread_over_s = SMOOTHED_OVER_S + interval_s
        self._left_mps += (left_m - self._left_mps * interval_s) / spread_over_s
        self._right_mps += (right_m - self._right_mps * interval_s) / spread_over_s
        return (self._right_mps**2 - self._left_mps**2) / (2.0 * self._wheel_separation_m)
