"""Brings two paths together in time, as far as both have come.

They are compared at the stamps of the sparser one: the denser is interpolated there, across at most
LARGEST_GAP_NS, as by evo's `--sync_method interpolation`. Where stamps are equal nothing is
interpolated, and evo's default (the nearest stamp) makes the same pairs.
"""

from __future__ import annotations

from typing import List, Tuple

import numpy as np

from diff_encoder_sim.base.pose_series import PoseSeries
from diff_encoder_sim.base.se2 import Pose2D, wrap_angle

# Poses come at 10 to 20 Hz. Across a longer gap, at 0.45 m/s and 1 rad/s, a chord is 2 mm and more off the path.
LARGEST_GAP_NS = 200_000_000
# So many poses of a path wait for the other to come to their stamps.
LARGEST_BACKLOG = 2_000

_UNKNOWN_NS = np.iinfo(np.int64).max // 2  # longer than any gap, later than any stamp


class WaitingPoses:
    """Poses of one path that are not paired yet, by ascending stamp, and the last before them."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Forget the path: the next pose begins another."""
        self.stamps_ns, self.poses = np.empty(0, np.int64), np.empty((0, 3))
        self._taken: List[Tuple[int, Pose2D]] = []  # not yet in the arrays
        self._paired = 0  # rows that are kept for interpolation alone

    def append(self, stamp_ns: int, pose: Pose2D) -> int:
        """Take the next pose, and count those that were taken since the last `pairs`."""
        self._taken.append((stamp_ns, pose))
        return len(self._taken)

    def extend(self, series: PoseSeries) -> None:
        """Take the next poses, in the order of their stamps."""
        self.stamps_ns = np.concatenate((self.stamps_ns, series.stamps_ns))
        self.poses = np.concatenate((self.poses, series.x_y_yaw))

    def gather(self) -> None:
        """Move what was appended to the arrays."""
        if self._taken:
            stamps_ns, poses = zip(*self._taken)
            self.extend(PoseSeries(np.array(stamps_ns, np.int64), np.array(poses)))
            self._taken = []

    def newest_ns(self) -> int:
        """Return the last stamp, or one before all others where there is none."""
        return int(self.stamps_ns[-1]) if len(self.stamps_ns) else -_UNKNOWN_NS

    def rows_until(self, stamp_ns: int) -> slice:
        """Find the rows to pair."""
        return slice(self._paired, int(np.searchsorted(self.stamps_ns, stamp_ns, 'right')))

    def steps_ns(self, rows: slice) -> np.ndarray:
        """Return how long after the one before some poses are; the first as long as the second."""
        steps_ns = np.diff(self.stamps_ns)
        return np.concatenate((steps_ns[:1] if len(steps_ns) else [LARGEST_GAP_NS], steps_ns))[rows]

    def at(self, stamps_ns: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
        """Interpolate poses (n, 3), yaw by the shorter turn; with the gaps (n,) [ns] that were bridged.

        A gap is that between the two poses around a stamp: 0 at a pose, unknown where it is too long.
        """
        after = np.searchsorted(self.stamps_ns, stamps_ns).clip(max=len(self.stamps_ns) - 1)
        is_pose = self.stamps_ns[after] == stamps_ns
        if is_pose.all():
            return self.poses[after], np.zeros(len(after), np.int64)
        before = np.where(is_pose, after, (after - 1).clip(min=0))
        before_ns, gaps_ns = self.stamps_ns[before], self.stamps_ns[after] - self.stamps_ns[before]
        steps = self.poses[after] - self.poses[before]
        steps[:, 2] = wrap_angle(steps[:, 2])
        fractions = (stamps_ns - before_ns) / np.maximum(gaps_ns, 1)
        is_known = (before_ns <= stamps_ns) & (stamps_ns <= self.stamps_ns[after]) & (gaps_ns <= LARGEST_GAP_NS)
        poses = self.poses[before] + fractions[:, np.newaxis] * steps
        return poses, np.where(is_known, gaps_ns, _UNKNOWN_NS)

    def drop_until(self, stamp_ns: int) -> None:
        """Drop poses that have been paired, but for the last of them, and the oldest beyond LARGEST_BACKLOG."""
        paired = self.rows_until(stamp_ns).stop
        first = max(paired - 1, len(self.stamps_ns) - LARGEST_BACKLOG, 0)
        self._paired = max(paired - first, 0)
        self.stamps_ns, self.poses = self.stamps_ns[first:], self.poses[first:]


def take_pairs(estimate: WaitingPoses, reference: WaitingPoses) -> np.ndarray:
    """Take the pairs that both paths have come to: (n, 6) x [m], y [m], yaw [rad] of estimate and reference."""
    estimate.gather()
    reference.gather()
    until_ns = min(estimate.newest_ns(), reference.newest_ns())
    at, poses, references, excess_ns, _ = _meet(estimate, reference, until_ns)
    stamps_ns, paired = at[excess_ns >= 0], np.hstack((poses, references))[excess_ns >= 0]
    at, poses, estimates, excess_ns, is_equal = _meet(reference, estimate, until_ns)
    # Equal stamps, and paths that are equally dense, are paired at the estimate's stamps already.
    chosen = (excess_ns > 0) & ~is_equal
    if chosen.any():
        order = np.argsort(np.concatenate((stamps_ns, at[chosen])))
        paired = np.concatenate((paired, np.hstack((estimates, poses))[chosen]))[order]
    estimate.drop_until(until_ns)
    reference.drop_until(until_ns)
    return paired


def _meet(own: WaitingPoses, other: WaitingPoses, until_ns: int) -> Tuple[np.ndarray, ...]:
    """Look from each pose of one path at the other.

    Returns:
        stamps (n,), own poses (n, 3), the other's there (n, 3), by how much the other's gap there is shorter
        than the step to the own pose [ns] (n,), and whether stamps are equal (n,).
    """
    rows = own.rows_until(until_ns)
    stamps_ns = own.stamps_ns[rows]
    others, gaps_ns = other.at(stamps_ns)
    return stamps_ns, own.poses[rows], others, own.steps_ns(rows) - gaps_ns, gaps_ns == 0
