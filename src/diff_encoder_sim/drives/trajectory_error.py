"""How far one path is from another: absolute (ATE), and relative by distance (RPE), as evo computes them.

docs/recorded_drives.md has the definitions, and evo's command lines for the same numbers. A pair of poses is a row
of six numbers: x [m], y [m], yaw [rad] of the estimate, then of the reference.
"""

from __future__ import annotations

import enum
import math
from typing import Dict, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D, PoseSeries, steps_m, wrap_angles
from diff_encoder_sim.drives.wheel_source import LONGEST_GAP_NS

# Poses come at 10 to 20 Hz. Across a longer gap, at 0.45 m/s and 1 rad/s, a chord is 2 mm and more off the path.
LARGEST_GAP_NS = 200_000_000
_UNKNOWN_NS = np.iinfo(np.int64).max // 2  # longer than any gap

LENGTH_TOLERANCE = 0.1  # a segment of all pairs is as long as its distance within this fraction: evo's --delta_tol
RPE_DISTANCES_M = (1.0, 5.0, 10.0)  # lengths of segments


class Alignment(enum.Enum):
    """What is done to the estimate before positions are compared."""

    NONE = 'none'  # both are in the same frame: an error of the start counts
    ORIGIN = 'origin'  # the first common poses are laid on each other, as odometry begins anywhere
    FIT = 'fit'  # rotation and translation by least squares (Umeyama 1991, no scale), for a reference without yaw


class RpePairs(str, enum.Enum):
    """Which poses are the ends of segments, by evo's names."""

    CONSECUTIVE = 'consecutive'  # segments end to end, from the first pose
    ALL = 'all_pairs'  # a segment from every pose

    @property
    def text(self) -> str:
        """Name the convention in a sentence."""
        return self.value.replace('_', ' ')


def rpe_name(pairs: RpePairs, distance_m: float) -> str:
    """Begin the names of the columns of one RPE: rpe_10m for consecutive pairs, rpe_10m_all_pairs."""
    return f'rpe_{distance_m:g}m' + ('' if pairs is RpePairs.CONSECUTIVE else f'_{pairs.value}')


class RelativeError(NamedTuple):
    """Root mean squares over the segments of one length; not a number without one."""

    segments: int
    translation_rmse_m: float
    rotation_rmse_rad: float


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


def path_error(estimate: PoseSeries, reference: PoseSeries, alignment: Alignment) -> Optional[PathError]:
    """Compare two paths, in any order of their messages; None without a common stamp."""
    return pairs_error([common_poses(estimate.by_time(), reference.by_time())], alignment)


def common_poses(estimate: PoseSeries, reference: PoseSeries) -> np.ndarray:
    """Return pairs (n, 6) at `common_stamps`; the stamps ascend."""
    pairing = common_stamps(estimate.stamps_ns, reference)
    return np.hstack((pairing.estimates(estimate.x_y_yaw), pairing.references))


def pairs_error(runs: Sequence[np.ndarray], alignment: Alignment) -> Optional[PathError]:
    """Compute the errors of pairs (n, 6) by time, in several runs if time was set back; None without a pair.

    Each run is aligned by its first pair, and no segment reaches from one into the next.
    """
    runs = [pairs for pairs in runs if len(pairs)]
    if not runs:
        return None
    estimates, references = np.hsplit(np.concatenate([aligned(pairs, alignment) for pairs in runs]), 2)
    errors = estimates - references
    errors[:, 2] = wrap_angles(errors[:, 2])
    distances_m, yaws_rad = np.hypot(errors[:, 0], errors[:, 1]), np.abs(errors[:, 2])
    return PathError(
        len(errors),
        math.sqrt(float(distances_m @ distances_m) / len(errors)),
        float(distances_m.max()),
        math.sqrt(float(yaws_rad @ yaws_rad) / len(errors)),
        float(yaws_rad.max()),
        Pose2D(*errors[-1].tolist()),
        sum(float(steps_m(pairs[:, 3:]).sum()) for pairs in runs),
        relative_errors(runs),
    )


class Pairing(NamedTuple):
    """How an estimate is interpolated for its pairs with a reference: any estimate with these stamps."""

    before: np.ndarray  # (n,) rows of the estimate
    after: np.ndarray
    fractions: np.ndarray  # of the step between them
    references: np.ndarray  # (n, 3)

    def estimates(self, x_y_yaw: np.ndarray) -> np.ndarray:
        """Return (..., n, 3) for poses (..., m, 3) of the estimate."""
        return _between(x_y_yaw, *self[:3])


def common_stamps(estimate_ns: np.ndarray, reference: PoseSeries) -> Pairing:
    """Return the pairing at the stamps of the sparser of two paths, or the estimate's.

    Between two stamps of the other path, poses are interpolated, unless these are more than LARGEST_GAP_NS apart.
    """
    if not (len(estimate_ns) and len(reference.stamps_ns)):
        none = np.zeros(0, np.int64)
        return Pairing(none, none, np.zeros(0), np.empty((0, 3)))
    place, gaps_ns, _ = _place(estimate_ns, reference.stamps_ns, LARGEST_GAP_NS)
    own = np.flatnonzero(_own_steps_ns(estimate_ns) >= gaps_ns)
    references = _between(reference.x_y_yaw, *(each[own] for each in place))
    place, gaps_ns, is_equal = _place(reference.stamps_ns, estimate_ns, LARGEST_GAP_NS)
    others = np.flatnonzero((_own_steps_ns(reference.stamps_ns) > gaps_ns) & ~is_equal)  # equal ones are paired above
    order = np.argsort(np.concatenate((estimate_ns[own], reference.stamps_ns[others])), kind='stable')
    of_own = own, own, np.zeros(len(own)), references
    of_others = (*(each[others] for each in place), reference.x_y_yaw[others])
    return Pairing(*(np.concatenate(each)[order] for each in zip(of_own, of_others)))


def reference_stamps(estimate_ns: np.ndarray, reference: PoseSeries) -> Pairing:
    """Return the pairing at the stamps of the reference between two of the estimate, LONGEST_GAP_NS apart at most."""
    if not len(estimate_ns):
        return common_stamps(estimate_ns, reference)
    place, gaps_ns, _ = _place(reference.stamps_ns, estimate_ns, LONGEST_GAP_NS)
    rows = gaps_ns < _UNKNOWN_NS
    before, after, fractions = (each[rows] for each in place)
    return Pairing(before, after, fractions, reference.x_y_yaw[rows])


def _own_steps_ns(stamps_ns: np.ndarray) -> np.ndarray:
    """Return the time from the previous pose to each (n,); the first one's is that to the next."""
    steps_ns = np.diff(stamps_ns)
    return np.concatenate((steps_ns[:1] if len(steps_ns) else [LARGEST_GAP_NS], steps_ns))


def _place(
    stamps_ns: np.ndarray, other_ns: np.ndarray, largest_gap_ns: int
) -> Tuple[Tuple[np.ndarray, np.ndarray, np.ndarray], np.ndarray, np.ndarray]:
    """Find stamps (n,) between those of another path.

    Return the rows before and after and the fraction between them, the length of this gap [ns] (n,), or _UNKNOWN_NS if
    it is too long, and whether stamps are equal (n,).
    """
    after = np.searchsorted(other_ns, stamps_ns).clip(max=len(other_ns) - 1)
    is_equal = other_ns[after] == stamps_ns
    before = np.where(is_equal, after, (after - 1).clip(min=0))
    before_ns, gaps_ns = other_ns[before], other_ns[after] - other_ns[before]
    is_known = (before_ns <= stamps_ns) & (stamps_ns <= other_ns[after]) & (gaps_ns <= largest_gap_ns)
    fractions = (stamps_ns - before_ns) / np.maximum(gaps_ns, 1)
    return (before, after, fractions), np.where(is_known, gaps_ns, _UNKNOWN_NS), is_equal


def _between(x_y_yaw: np.ndarray, before: np.ndarray, after: np.ndarray, fractions: np.ndarray) -> np.ndarray:
    """Interpolate poses (..., m, 3), yaw by the shorter turn: (..., n, 3)."""
    poses = np.take(x_y_yaw, before, axis=-2)
    if fractions.any():
        turns = np.take(x_y_yaw, after, axis=-2) - poses
        turns[..., 2] = wrap_angles(turns[..., 2])
        poses += fractions[:, np.newaxis] * turns
    return np.asarray(poses)


def aligned(pairs: np.ndarray, alignment: Alignment) -> np.ndarray:
    """Return pairs (n, 6) in the common frame: of the start, of the reference's centre, or as they are."""
    x_y_m, yaws_rad = _split(pairs)
    if alignment is Alignment.ORIGIN:
        x_y_m, yaws_rad = _seen_from(x_y_m[0], yaws_rad[0], x_y_m), yaws_rad - yaws_rad[0]
    elif alignment is Alignment.FIT:
        x_y_m = x_y_m - x_y_m.mean(axis=0)
        x_y_m[:, 0] *= np.exp(1j * np.angle(np.vdot(x_y_m[:, 0], x_y_m[:, 1])))
    return np.asarray(np.stack((x_y_m.real, x_y_m.imag, yaws_rad), axis=-1).reshape(-1, 6))


def _split(pairs: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return places x + iy [m] and yaws [rad] of the estimate and the reference (n, 2)."""
    return pairs[:, 0::3] + 1j * pairs[:, 1::3], pairs[:, 2::3]


def _seen_from(frames_m: np.ndarray, yaws_rad: np.ndarray, places_m: np.ndarray) -> np.ndarray:
    return np.asarray((places_m - frames_m) * (np.cos(yaws_rad) - 1j * np.sin(yaws_rad)))


def relative_errors(runs: Sequence[np.ndarray]) -> Dict[RpePairs, Dict[float, RelativeError]]:
    """Return the RPE over pairs (n, 6) of each run, by convention and by the length of the segments [m].

    A reference without yaw has no motion relative to a pose: there is no segment.
    """
    runs = [pairs[~np.isnan(pairs[:, 5])] for pairs in runs]
    steps = [steps_m(pairs[:, 3:]) for pairs in runs]
    results: Dict[RpePairs, Dict[float, RelativeError]] = {convention: {} for convention in RpePairs}
    for convention, segments_of in ((RpePairs.CONSECUTIVE, _consecutive), (RpePairs.ALL, _from_every_pose)):
        for distance_m in RPE_DISTANCES_M:
            found = [_segment_errors(pairs, *segments_of(of_run_m, distance_m)) for pairs, of_run_m in zip(runs, steps)]
            squares_m2, squares_rad2 = (np.concatenate(parts) for parts in zip(*found))
            count = len(squares_m2)
            mean_m2, mean_rad2 = (float(squares.sum()) / (count or math.nan) for squares in (squares_m2, squares_rad2))
            results[convention][distance_m] = RelativeError(count, math.sqrt(mean_m2), math.sqrt(mean_rad2))
    return results


def _segment_errors(pairs: np.ndarray, starts: np.ndarray, ends: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return the squares of each segment's errors: translation [m^2], rotation [rad^2]."""
    x_y_m, yaws_rad = _split(pairs)
    motions_m = _seen_from(x_y_m[starts], yaws_rad[starts], x_y_m[ends])
    errors_m = motions_m[:, 0] - motions_m[:, 1]
    offsets_rad = yaws_rad[:, 0] - yaws_rad[:, 1]
    turns_rad = wrap_angles(offsets_rad[ends] - offsets_rad[starts])
    return np.square(errors_m.real) + np.square(errors_m.imag), np.square(turns_rad)


def _consecutive(steps: np.ndarray, distance_m: float) -> Tuple[np.ndarray, np.ndarray]:
    """Find the poses between which segments lie end to end: each ends at the first pose that is as far along."""
    poses, since_m = [0], 0.0  # summed from the segment's start, as evo does, digit for digit
    for index, step_m in enumerate(steps.tolist(), 1):
        since_m += step_m
        if since_m >= distance_m:
            poses.append(index)
            since_m = 0.0
    return np.array(poses[:-1], int), np.array(poses[1:], int)


def _from_every_pose(steps: np.ndarray, distance_m: float) -> Tuple[np.ndarray, np.ndarray]:
    """Find a segment from every pose to the pose nearest to the distance along the path, within the tolerance.

    Of poses at the same length the first is taken, of two as near the shorter segment.
    """
    lengths_m = np.concatenate(([0.0], np.cumsum(steps)))
    first_as_long = np.searchsorted(lengths_m, lengths_m)  # a robot that stands repeats itself
    beyond = np.searchsorted(lengths_m, lengths_m + distance_m)
    before = first_as_long[beyond - 1]
    beyond = np.minimum(beyond, first_as_long[-1])  # the last segments may be short by the tolerance
    misses_m = [np.abs(lengths_m[ends] - lengths_m - distance_m) for ends in (before, beyond)]
    ends = np.where(misses_m[0] <= misses_m[1], before, beyond)
    starts = np.flatnonzero(np.minimum(*misses_m) <= distance_m * LENGTH_TOLERANCE)
    return starts, ends[starts]
