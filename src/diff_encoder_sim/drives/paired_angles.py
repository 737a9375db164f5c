"""Both wheels at the same instants, where each comes at times of its own."""

from __future__ import annotations

from collections import deque
from typing import Deque, List, NamedTuple, Optional, Tuple

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND

# Across a longer gap nobody knows how a wheel has turned.
LONGEST_GAP_NS = NANOSECONDS_PER_SECOND

LEFT, RIGHT = 0, 1


class _Angle(NamedTuple):
    stamp_ns: int
    angle_rad: float


class PairedAngles:
    """Gives both wheels at the stamps of the left one, the right one interpolated between the two around it.

    Keeps no more than a second of either.
    """

    def __init__(self) -> None:
        self._sides: Tuple[Deque[_Angle], Deque[_Angle]] = (deque(), deque())
        self._newest_ns: List[Optional[int]] = [None, None]
        self._has_paired = False
        self.left_out = 0  # angles of the left wheel since the first pair that the right one has none near

    def add(self, side: int, stamp_ns: int, angle_rad: float) -> List[Tuple[int, float, float]]:
        """Take an angle of one side, LEFT or RIGHT, and return the instants that it completes: stamp, left, right."""
        newest_ns = self._newest_ns[side]
        if newest_ns is not None and newest_ns - LONGEST_GAP_NS <= stamp_ns <= newest_ns:
            return []  # repeated, or overtaken
        if newest_ns is not None and stamp_ns < newest_ns:  # time was set back
            self._restart()
        self._newest_ns[side] = stamp_ns
        self._sides[side].append(_Angle(stamp_ns, angle_rad))
        self._forget()
        return self._pairs()

    def _restart(self) -> None:
        self._newest_ns = [None, None]
        for of_side in self._sides:
            of_side.clear()

    def _forget(self) -> None:
        """Drop what is too old to be paired."""
        for of_side in self._sides:
            while len(of_side) > 1 and of_side[0].stamp_ns < of_side[-1].stamp_ns - LONGEST_GAP_NS:
                of_side.popleft()
                self.left_out += self._has_paired and of_side is self._sides[LEFT]

    def _pairs(self) -> List[Tuple[int, float, float]]:
        lefts, rights = self._sides
        pairs = []
        while lefts and rights and lefts[0].stamp_ns <= rights[-1].stamp_ns:
            left = lefts.popleft()
            while len(rights) > 1 and rights[1].stamp_ns <= left.stamp_ns:
                rights.popleft()
            if rights[0].stamp_ns > left.stamp_ns:  # the right wheel begins later, or was away
                self.left_out += self._has_paired
                continue
            self._has_paired = True
            pairs.append((left.stamp_ns, left.angle_rad, _between(rights[0], rights[min(1, len(rights) - 1)], left)))
        return pairs


def _between(older: _Angle, newer: _Angle, at: _Angle) -> float:
    if older.stamp_ns == at.stamp_ns:
        return older.angle_rad
    fraction = (at.stamp_ns - older.stamp_ns) / (newer.stamp_ns - older.stamp_ns)
    return older.angle_rad + fraction * (newer.angle_rad - older.angle_rad)
