"""How far one path is from another: absolute (ATE), and relative by distance (RPE), as evo has them.

docs/trajectory_errors.md has the definitions, and evo's command lines for the same numbers.
"""

from __future__ import annotations

import enum
import math
from typing import Dict, NamedTuple, Optional

import numpy as np

from diff_encoder_sim.base.pose_series import PoseSeries
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, wrap_angle
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step, Timeline
from diff_encoder_sim.drives.pose_pairing import WaitingPoses, take_pairs
from diff_encoder_sim.drives.relative_error import RpePairs, RunningRelativeErrors
from diff_encoder_sim.drives.rpe_segments import RelativeError

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
