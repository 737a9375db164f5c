"""How far one path is from another, pose by pose as they come: memory does not grow with them.

Both paths are seen from where they have their first stamp in common; nothing is fitted.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Deque, Dict, NamedTuple, Optional, Tuple

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, interpolate, wrap_angle
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND

# Along the reference.
RPE_DISTANCES_M = (1.0, 5.0, 10.0)
# Stretches begin so far apart: each sample of a slow robot would say the same again.
START_SPACING_M = 0.1

# Between poses further apart a path is not known.
LARGEST_GAP_NS = NANOSECONDS_PER_SECOND
# So many poses of either path wait for the other to come to their stamps.
LARGEST_BACKLOG = 2_000

_Stamped = Tuple[int, Pose2D]


class RelativeError(NamedTuple):
    """Relative pose error (RPE) of all stretches of one length."""

    count: int
    position_rmse_m: float
    yaw_rmse_rad: float


class PathError(NamedTuple):
    """Estimate minus reference, both as seen from their first common stamp."""

    count: int  # of common stamps
    position_rmse_m: float  # absolute trajectory error (ATE)
    position_max_m: float
    yaw_rmse_rad: float
    end: Pose2D  # at the last common stamp; along and across the start heading
    length_m: float  # of the reference
    relative: Dict[float, RelativeError]  # by length of the stretch [m]


class RunningPathError:
    """Sums of squares over pairs of poses of one instant."""

    def __init__(self) -> None:
        self._count = 0
        self._position_sum, self._position_max, self._yaw_sum = 0.0, 0.0, 0.0
        self._length_m = 0.0
        self._end = IDENTITY
        self._stretches = {distance_m: _Stretches(distance_m) for distance_m in RPE_DISTANCES_M}
        self.restart()

    def restart(self) -> None:
        """The next pair is the start of both paths again."""
        self._starts: Optional[Tuple[Pose2D, Pose2D]] = None
        self._last_reference = IDENTITY
        self._last_start_m = -math.inf
        for stretches in self._stretches.values():
            stretches.restart()

    def add(self, estimate: Pose2D, reference: Pose2D) -> None:
        """Take one pair, each in a frame of its own."""
        if self._starts is None:
            self._starts = estimate, reference
            self._last_reference = reference
        self._length_m += math.hypot(reference.x_m - self._last_reference.x_m, reference.y_m - self._last_reference.y_m)
        self._last_reference = reference
        self._add_absolute(estimate.relative_to(self._starts[0]), reference.relative_to(self._starts[1]))
        self._add_relative(estimate, reference)

    def _add_absolute(self, estimate: Pose2D, reference: Pose2D) -> None:
        self._end = Pose2D(
            estimate.x_m - reference.x_m, estimate.y_m - reference.y_m, wrap_angle(estimate.yaw_rad - reference.yaw_rad)
        )
        square = self._end.x_m**2 + self._end.y_m**2
        self._count += 1
        self._position_sum += square
        self._position_max = max(self._position_max, square)
        self._yaw_sum += self._end.yaw_rad**2

    def _add_relative(self, estimate: Pose2D, reference: Pose2D) -> None:
        is_start = self._length_m - self._last_start_m >= START_SPACING_M
        if is_start:
            self._last_start_m = self._length_m
        for stretches in self._stretches.values():
            stretches.add(self._length_m, estimate, reference, is_start)

    def result(self) -> Optional[PathError]:
        """Of all pairs so far; None before the first."""
        if self._count == 0:
            return None
        return PathError(
            self._count,
            math.sqrt(self._position_sum / self._count),
            math.sqrt(self._position_max),
            math.sqrt(self._yaw_sum / self._count),
            self._end,
            self._length_m,
            {distance_m: stretches.result() for distance_m, stretches in self._stretches.items()},
        )


class _Start(NamedTuple):
    length_m: float
    estimate: Pose2D
    reference: Pose2D


class _Stretches:
    """Those of one length: each ends at the first pair that is as far along the reference."""

    def __init__(self, distance_m: float) -> None:
        self._distance_m = distance_m
        self._open: Deque[_Start] = deque()
        self._count, self._position_sum, self._yaw_sum = 0, 0.0, 0.0

    def restart(self) -> None:
        """Stretches that have not ended never will."""
        self._open.clear()

    def add(self, length_m: float, estimate: Pose2D, reference: Pose2D, is_start: bool) -> None:
        """Take the next pair, `length_m` along the reference; a stretch may begin at it."""
        while self._open and length_m - self._open[0].length_m >= self._distance_m:
            start = self._open.popleft()
            error = estimate.relative_to(start.estimate).relative_to(reference.relative_to(start.reference))
            self._count += 1
            self._position_sum += error.x_m**2 + error.y_m**2
            self._yaw_sum += error.yaw_rad**2
        if is_start:
            self._open.append(_Start(length_m, estimate, reference))

    def result(self) -> RelativeError:
        """Of the stretches that have ended; not a number before the first."""
        count = self._count or math.nan
        return RelativeError(self._count, math.sqrt(self._position_sum / count), math.sqrt(self._yaw_sum / count))


class PathComparison:
    """Brings two streams of poses together, at the stamps of the reference.

    Between its own stamps the estimate is interpolated; where stamps are equal nothing is. Either
    stream may lag behind the other.
    """

    def __init__(self) -> None:
        self.error = RunningPathError()
        self._estimates: Deque[_Stamped] = deque(maxlen=LARGEST_BACKLOG)
        self._references: Deque[_Stamped] = deque(maxlen=LARGEST_BACKLOG)
        self._newest_reference_ns: Optional[int] = None

    def take_reference(self, stamp_ns: int, pose: Pose2D) -> None:
        """The next pose of the reference; one that repeats or precedes the last is dropped."""
        newest_ns = self._newest_reference_ns
        if newest_ns is not None and newest_ns - LARGEST_GAP_NS < stamp_ns <= newest_ns:
            return
        if newest_ns is not None and stamp_ns < newest_ns:  # time itself has jumped back
            self._references.clear()
        self._newest_reference_ns = stamp_ns
        self._references.append((stamp_ns, pose))
        self._pair()

    def take_estimate(self, stamp_ns: int, pose: Pose2D) -> None:
        """The next pose of the estimate; one with an earlier stamp begins both paths again."""
        if self._estimates and stamp_ns < self._estimates[-1][0]:
            self._estimates.clear()
            self.error.restart()
        self._estimates.append((stamp_ns, pose))
        self._pair()

    def _pair(self) -> None:
        estimates, references = self._estimates, self._references
        while references and estimates and references[0][0] <= estimates[-1][0]:
            stamp_ns, reference = references.popleft()
            while len(estimates) > 1 and estimates[1][0] <= stamp_ns:
                estimates.popleft()
            before_ns, before = estimates[0]
            if before_ns == stamp_ns:
                self.error.add(before, reference)
            elif before_ns < stamp_ns and estimates[1][0] - before_ns <= LARGEST_GAP_NS:
                share = (stamp_ns - before_ns) / (estimates[1][0] - before_ns)
                self.error.add(interpolate(before, estimates[1][1], share), reference)
