"""How far one path is from another: absolute (ATE), and relative by distance (RPE), as evo has them.

docs/recorded_drives.md has the definitions, and evo's command lines for the same numbers.
"""

from __future__ import annotations

import enum
import math
from typing import Dict, List, NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, PoseSeries, steps_m, wrap_angle
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step, Timeline

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


# Lengths of segments.
RPE_DISTANCES_M = (1.0, 5.0, 10.0)


class RpePairs(str, enum.Enum):
    """Which poses are the ends of segments, by evo's names."""

    CONSECUTIVE = 'consecutive'  # segments end to end, from the first pose on
    ALL = 'all_pairs'  # a segment from every pose on

    @property
    def text(self) -> str:
        """Name the convention in a sentence."""
        return self.value.replace('_', ' ')


def rpe_name(pairs: RpePairs, distance_m: float) -> str:
    """Begin the names of the columns of one RPE: rpe_10m for consecutive pairs, rpe_10m_all_pairs."""
    return f'rpe_{distance_m:g}m' + ('' if pairs is RpePairs.CONSECUTIVE else f'_{pairs.value}')


class RunningRelativeErrors:
    """RPE over all of RPE_DISTANCES_M with both conventions, as pairs of poses come."""

    def __init__(self) -> None:
        self.length_m = 0.0  # of the reference
        self._last = np.empty((0, 6))  # one row, once there is a pair
        self._consecutive = {distance_m: ConsecutiveSegments(distance_m) for distance_m in RPE_DISTANCES_M}
        self._all = {distance_m: AllSegments(distance_m) for distance_m in RPE_DISTANCES_M}

    def restart(self) -> None:
        """Begin another path with the next pair; no segment reaches across."""
        self._last = self._last[:0]
        for distance_m in RPE_DISTANCES_M:
            self._consecutive[distance_m].restart()
            self._all[distance_m].restart()

    def add(self, pairs: np.ndarray) -> None:
        """Take the next pairs, at least one: (n, 6) x [m], y [m], yaw [rad] of estimate and reference."""
        steps = steps_m(np.concatenate((self._last if len(self._last) else pairs[:1], pairs))[:, 3:])
        # Summed from pose to pose, as evo does, and not anew in each block.
        lengths_m = np.cumsum(np.concatenate(([self.length_m], steps)))[1:]
        self.length_m, self._last = float(lengths_m[-1]), pairs[-1:]
        planar = planar_pairs(pairs)
        # A robot that stands repeats itself: such pairs are kept once, with their count.
        firsts = np.flatnonzero(np.concatenate(([True], (planar[1:] != planar[:-1]).any(axis=1))))
        distinct = lengths_m[firsts], planar[firsts], np.diff(firsts, append=len(planar))
        step_list = steps.tolist()
        for distance_m in RPE_DISTANCES_M:
            self._consecutive[distance_m].add(step_list, planar)
            self._all[distance_m].add(*distinct)

    def results(self) -> Dict[RpePairs, Dict[float, RelativeError]]:
        """Return the errors over all pairs so far, by length of the segments [m]."""
        return {
            RpePairs.CONSECUTIVE: {distance_m: one.result() for distance_m, one in self._consecutive.items()},
            RpePairs.ALL: {distance_m: one.result() for distance_m, one in self._all.items()},
        }


# A reference pose that is older than the newest by no more than this was overtaken by another message: it is dropped.
OVERTAKEN_NS = NANOSECONDS_PER_SECOND
# So many poses are compared at a time: what they take stays in the processor's cache.
BLOCK = 1000


class Alignment(enum.Enum):
    """What is done to the estimate before positions are compared. Nothing is ever fitted."""

    NONE = 'none'  # both are in the same frame: an error of the start counts
    ORIGIN = 'origin'  # the first common poses are laid on each other, as odometry begins anywhere


class PathError(NamedTuple):
    """An estimate minus its reference, at the stamps they have in common."""

    poses: int  # compared
    ate_rmse_m: float
    ate_max_m: float
    yaw_rmse_rad: float
    yaw_max_rad: float
    end: Pose2D  # of the last pose; along the axes of the common frame, or of the start pose
    length_m: float  # of the reference
    rpe: Dict[RpePairs, Dict[float, RelativeError]]  # by length of the segments [m]


class RunningPathError:
    """Sums over pairs of poses as they come: memory grows neither with time nor with length."""

    def __init__(self, alignment: Alignment) -> None:
        self._alignment = alignment
        self._poses = 0
        self._square_m2, self._largest_m, self._square_rad2, self._largest_rad = 0.0, 0.0, 0.0, 0.0
        self._first, self._end = np.empty((0, 6)), IDENTITY  # one row, once there is a pair
        self._relative = RunningRelativeErrors()

    def restart(self) -> None:
        """Begin both paths again with the next pair."""
        self._first = self._first[:0]
        self._relative.restart()

    def add(self, pairs: np.ndarray) -> None:
        """Take the next pairs: (n, 6) x [m], y [m], yaw [rad] of the estimate, then of the reference.

        Raises:
            ValueError: the shape is another.
        """
        if pairs.ndim != 2 or pairs.shape[1] != 6:
            raise ValueError(f'given pairs of shape {pairs.shape}; allowed: (n, 6)')
        if len(pairs) == 0:
            return
        if len(self._first) == 0:
            self._first = pairs[:1]
        self._add_absolute(pairs)
        self._relative.add(pairs)

    def result(self) -> Optional[PathError]:
        """Return the error over all pairs so far; None before the first."""
        if self._poses == 0:
            return None
        return PathError(
            self._poses,
            math.sqrt(self._square_m2 / self._poses),
            self._largest_m,
            math.sqrt(self._square_rad2 / self._poses),
            self._largest_rad,
            self._end,
            self._relative.length_m,
            self._relative.results(),
        )

    def _add_absolute(self, pairs: np.ndarray) -> None:
        errors = self._errors(pairs)
        distances_m, yaws_rad = np.hypot(errors[:, 0], errors[:, 1]), np.abs(errors[:, 2])
        self._poses += len(errors)
        self._square_m2 += float(distances_m @ distances_m)
        self._square_rad2 += float(yaws_rad @ yaws_rad)
        self._largest_m = max(self._largest_m, float(distances_m.max()))
        self._largest_rad = max(self._largest_rad, float(yaws_rad.max()))
        self._end = Pose2D(*errors[-1].tolist())

    def _errors(self, pairs: np.ndarray) -> np.ndarray:
        """Subtract the reference from the estimate once they are aligned: (n, 3) [m, m, rad], yaw wrapped."""
        estimates, references = pairs[:, :3], pairs[:, 3:]
        if self._alignment is Alignment.ORIGIN:
            estimates = _seen_from(self._first[0, :3], estimates)
            references = _seen_from(self._first[0, 3:], references)
        errors = estimates - references
        errors[:, 2] = wrap_angle(errors[:, 2])
        return np.asarray(errors)


class PathComparison:
    """Compares two streams of stamped poses; either may lag behind the other."""

    def __init__(self, alignment: Alignment) -> None:
        self._error = RunningPathError(alignment)
        self._estimate, self._reference = WaitingPoses(), WaitingPoses()
        self._estimate_time, self._reference_time = Timeline(0), Timeline(OVERTAKEN_NS)

    def take_reference(self, stamp_ns: int, pose: Pose2D) -> None:
        """Take the next pose of the reference; one that repeats or precedes the last is dropped."""
        step = self._reference_time.advance(stamp_ns)
        if step is Step.RESTART:
            self._compare()
            self._reference.clear()
        if step is not Step.STALE and self._reference.append(stamp_ns, pose) >= BLOCK:
            self._compare()

    def take_estimate(self, stamp_ns: int, pose: Pose2D) -> None:
        """Take the next pose of the estimate; one with an earlier stamp begins both paths again."""
        step = self._estimate_time.advance(stamp_ns)
        if step is Step.RESTART:
            self._compare()
            self._estimate.clear()
            self._error.restart()
        if step is not Step.STALE and self._estimate.append(stamp_ns, pose) >= BLOCK:
            self._compare()

    def take_series(self, estimate: PoseSeries, reference: PoseSeries) -> None:
        """Take all poses of both at once, each in the order of its stamps."""
        self._estimate.extend(estimate)
        self._reference.extend(reference)
        self._compare()

    def result(self) -> Optional[PathError]:
        """Return the error so far; None without a common stamp."""
        self._compare()
        return self._error.result()

    def _compare(self) -> None:
        pairs = take_pairs(self._estimate, self._reference)
        for first in range(0, len(pairs), BLOCK):
            self._error.add(pairs[first : first + BLOCK])


def path_error(estimate: PoseSeries, reference: PoseSeries, alignment: Alignment) -> Optional[PathError]:
    """Compare two whole paths, in any order of messages; None without a common stamp."""
    comparison = PathComparison(alignment)
    comparison.take_series(estimate.by_time(), reference.by_time())
    return comparison.result()


def _seen_from(frame: np.ndarray, poses: np.ndarray) -> np.ndarray:
    """Return poses (n, 3) as seen from one (3,) in the same frame; yaw is not wrapped."""
    x_m, y_m, yaw_rad = (poses - frame).T
    cos_yaw, sin_yaw = math.cos(frame[2]), math.sin(frame[2])
    return np.column_stack((cos_yaw * x_m + sin_yaw * y_m, cos_yaw * y_m - sin_yaw * x_m, yaw_rad))
