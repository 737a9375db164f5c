"""The two kinds of segments that a relative pose error (RPE) rests on, as evo chooses them.

A segment is a stretch of the reference's path. Its error is the estimate's motion from its first pose
to its last minus the reference's (Sturm et al., IROS 2012, equations 2 and 3; evo's `trans_part` and
`angle_rad`), so neither the frame nor the start of a path matters. Poses come in blocks of pairs, as
`planar_pairs` makes them.
"""

from __future__ import annotations

import math
from typing import List, NamedTuple

import numpy as np

from diff_encoder_sim.base.se2 import wrap_angle

# A segment of all pairs is as long as its delta within this fraction: evo's --delta_tol.
LENGTH_TOLERANCE = 0.1

# Where a robot does not move on, all of its poses could begin a segment. This many are 17 minutes at 20 Hz.
MOST_STARTS = 20_000


class RelativeError(NamedTuple):
    """Root mean squares over the segments of one length; not a number without one."""

    segments: int
    translation_rmse_m: float
    rotation_rmse_rad: float


def planar_pairs(pairs: np.ndarray) -> np.ndarray:
    """Turn (n, 6) x [m], y [m], yaw [rad] of estimate and reference into what segments need, each once.

    Returns:
        (n, 5) complex: both positions x + iy [m], both rotations exp(-i yaw), and the difference of the yaws [rad].
    """
    x_m, y_m, yaws_rad = pairs[:, 0::3], pairs[:, 1::3], pairs[:, 2::3]
    rotations = np.cos(yaws_rad) - 1j * np.sin(yaws_rad)
    return np.hstack((x_m + 1j * y_m, rotations, yaws_rad[:, :1] - yaws_rad[:, 1:]))


class SegmentSums(NamedTuple):
    """Sums of squared errors of segments."""

    segments: int = 0
    square_m2: float = 0.0
    square_rad2: float = 0.0

    def plus(self, starts: np.ndarray, ends: np.ndarray, counts: np.ndarray) -> SegmentSums:
        """Add segments from `starts` to `ends`, both (n, 5), each as many times as `counts` has it."""
        motions = (ends[:, :2] - starts[:, :2]) * starts[:, 2:4]  # as seen from the first pose
        errors = motions[:, 0] - motions[:, 1]
        yaws_rad = wrap_angle((ends[:, 4] - starts[:, 4]).real)
        return SegmentSums(
            self.segments + int(counts.sum()),
            self.square_m2 + float(counts @ (np.square(errors.real) + np.square(errors.imag))),
            self.square_rad2 + float(counts @ np.square(yaws_rad)),
        )

    def result(self) -> RelativeError:
        """Return the root mean squares."""
        count = self.segments or math.nan
        return RelativeError(self.segments, math.sqrt(self.square_m2 / count), math.sqrt(self.square_rad2 / count))


class ConsecutiveSegments:
    """Segments end to end: each ends at the first pose that is as far along, where the next begins."""

    def __init__(self, distance_m: float) -> None:
        self._distance_m, self._since_m = distance_m, 0.0
        self._start = np.empty((0, 5), complex)  # one row, once there is a pair
        self._sums = SegmentSums()

    def restart(self) -> None:
        """Leave the open segment unfinished; the next pose begins a path."""
        self._start, self._since_m = self._start[:0], 0.0

    def add(self, steps_m: List[float], pairs: np.ndarray) -> None:
        """Take the next block: (n, 5), and the path from the pair before to each, 0 to the first."""
        if len(self._start) == 0:
            self._start = pairs[:1]
        ends = pairs[self._ends(steps_m)]
        if len(ends) > 0:
            starts = np.concatenate((self._start, ends[:-1]))
            self._sums, self._start = self._sums.plus(starts, ends, np.ones(len(ends))), ends[-1:]

    def result(self) -> RelativeError:
        """Return the error over all segments so far."""
        return self._sums.result()

    def _ends(self, steps_m: List[float]) -> List[int]:
        """Find the poses at which a segment ends; summed from its start on, as evo does, digit for digit."""
        ends, since_m, distance_m = [], self._since_m, self._distance_m
        for index, step_m in enumerate(steps_m):
            since_m += step_m
            if since_m >= distance_m:
                ends.append(index)
                since_m = 0.0
        self._since_m = since_m
        return ends


class AllSegments:
    """A segment from every pose to that whose distance from it along the path is nearest to the given.

    Only poses whose segment has not ended are kept. Beyond MOST_STARTS, every second one stands for its
    successor as well.
    """

    def __init__(self, distance_m: float) -> None:
        self._distance_m = distance_m
        self._sums = SegmentSums()
        self._lengths_m, self._pairs, self._counts = np.empty(0), np.empty((0, 5), complex), np.empty(0)

    def restart(self) -> None:
        """Finish the path as `result` does; the next pose begins another."""
        self._sums = self._with_last_segments()
        self._keep(slice(0))

    def add(self, lengths_m: np.ndarray, pairs: np.ndarray, counts: np.ndarray) -> None:
        """Take the next block.

        Args:
            lengths_m: (n,) path from its beginning to each pair, ascending.
            pairs: (n, 5).
            counts: (n,) how many times each pair came, one after the other.
        """
        self._lengths_m = np.concatenate((self._lengths_m, lengths_m))
        self._pairs = np.concatenate((self._pairs, pairs))
        self._counts = np.concatenate((self._counts, counts))
        beyond = np.searchsorted(self._lengths_m, self._lengths_m + self._distance_m)
        ended = int(np.searchsorted(beyond, len(beyond)))  # those have a pose as far along, and none nearer to come
        self._sums = self._with_segments(self._nearest(beyond[:ended]))
        self._keep(slice(ended, None))
        while len(self._lengths_m) > MOST_STARTS:
            self._merge_neighbours()

    def result(self) -> RelativeError:
        """Return the error over all segments, as if the path ended here."""
        return self._with_last_segments().result()

    def _nearest(self, beyond: np.ndarray) -> np.ndarray:
        """Choose ends of the first segments: the pose `beyond` the distance or the one before, whichever is nearer.

        Of poses at the same length the first is taken, of two as near the shorter segment.
        """
        before = np.searchsorted(self._lengths_m, self._lengths_m[beyond - 1])
        misses_m = [np.abs(self._segment_lengths_m(ends) - self._distance_m) for ends in (before, beyond)]
        return np.where(misses_m[0] <= misses_m[1], before, beyond)

    def _segment_lengths_m(self, ends: np.ndarray) -> np.ndarray:
        return np.asarray(self._lengths_m[ends] - self._lengths_m[: len(ends)])

    def _with_segments(self, ends: np.ndarray) -> SegmentSums:
        """Add segments from the first poses, leaving out those whose length is not within tolerance."""
        misses_m = np.abs(self._segment_lengths_m(ends) - self._distance_m)
        is_within = misses_m <= self._distance_m * LENGTH_TOLERANCE
        # A slice of all is no copy.
        starts = slice(len(ends)) if is_within.all() else np.flatnonzero(is_within)
        return self._sums.plus(self._pairs[starts], self._pairs[ends[starts]], self._counts[starts])

    def _with_last_segments(self) -> SegmentSums:
        """Add the segments that end at the last pose, too short as they are, within tolerance."""
        if len(self._lengths_m) == 0:
            return self._sums
        last = int(np.searchsorted(self._lengths_m, self._lengths_m[-1]))
        return self._with_segments(np.full(len(self._lengths_m), last))

    def _keep(self, rows: slice) -> None:
        self._lengths_m, self._pairs, self._counts = self._lengths_m[rows], self._pairs[rows], self._counts[rows]

    def _merge_neighbours(self) -> None:
        counts = np.add.reduceat(self._counts, np.arange(0, len(self._counts), 2))
        self._keep(slice(None, None, 2))
        self._counts = counts
