"""How far poses are from the truth on the whole way: absolute, and relative by distance.

Both are in the map frame and nothing is aligned: an error of the heading at the start counts.
"""

from __future__ import annotations

from typing import Dict, List, NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.base.se2 import wrap_angle
from diff_encoder_sim.recording.trial_recording import PoseSeries

# The truth comes at 20 Hz; across a longer gap it is not guessed.
LONGEST_GAP_NS = 200_000_000

RPE_DISTANCES_M = (1.0, 5.0, 10.0)


class RelativeError(NamedTuple):
    """Of the motion over stretches of one length: root mean squares."""

    translation_rmse_m: float
    rotation_rmse_rad: float


class PathErrors(NamedTuple):
    """One source against the truth."""

    ate_rmse_m: float
    ate_max_m: float
    yaw_rmse_rad: float
    rpe: Dict[float, RelativeError]  # by true path length [m]; none where the path is shorter
    count: int  # poses compared


def path_errors(estimate: PoseSeries, truth: PoseSeries) -> Optional[PathErrors]:
    """Compare at the stamps of `estimate`; None where the truth tells nothing at any of them.

    Both in the map frame. ATE is evo's APE of the translation part.
    """
    stamps_ns, estimated = _by_time(estimate)
    true, is_known = _interpolated(stamps_ns, truth)
    if not is_known.any():
        return None
    estimated, true = estimated[is_known], true[is_known]
    offsets = estimated - true
    distances_m = np.hypot(offsets[:, 0], offsets[:, 1])
    return PathErrors(
        _rms(distances_m),
        float(distances_m.max()),
        _rms(wrap_angle(offsets[:, 2])),
        relative_errors(estimated, true),
        len(true),
    )


def relative_errors(estimated: np.ndarray, true: np.ndarray) -> Dict[float, RelativeError]:
    """RPE by distance: the estimate's motion minus the true one, over stretches end to end.

    As evo's for consecutive pairs by the path of the reference, with the stretch from the first
    pose on, which evo leaves out.

    Args:
        estimated, true: (n, 3) x [m], y [m], yaw [rad] at the same times.
    """
    steps_m = np.hypot(*np.diff(true[:, :2], axis=0).T)
    errors = {}
    for distance_m in RPE_DISTANCES_M:
        ends = _stretch_ends(steps_m, distance_m)
        if len(ends) > 1:
            difference = _motions(estimated[ends]) - _motions(true[ends])
            errors[distance_m] = RelativeError(
                _rms(np.hypot(difference[:, 0], difference[:, 1])), _rms(wrap_angle(difference[:, 2]))
            )
    return errors


def path_length_m(series: PoseSeries) -> float:
    """Along the poses of a series, in the order of their stamps."""
    return float(np.sum(np.hypot(*np.diff(_by_time(series)[1][:, :2], axis=0).T)))


def _by_time(series: PoseSeries) -> Tuple[np.ndarray, np.ndarray]:
    """Each stamp once, ascending, with its first pose."""
    stamps_ns, rows = np.unique(series.stamps_ns, return_index=True)
    return stamps_ns, series.x_y_yaw[rows]


def _interpolated(stamps_ns: np.ndarray, series: PoseSeries) -> Tuple[np.ndarray, np.ndarray]:
    """(n, 3) poses of a series at other stamps, yaw by the shorter turn; (n,) where it has them."""
    known_ns, poses = _by_time(series)
    after = np.searchsorted(known_ns, stamps_ns).clip(max=len(known_ns) - 1)
    before = np.where(known_ns[after] == stamps_ns, after, (after - 1).clip(min=0))
    gaps_ns = known_ns[after] - known_ns[before]
    share = (stamps_ns - known_ns[before]) / np.maximum(gaps_ns, 1)
    steps = poses[after] - poses[before]
    steps[:, 2] = wrap_angle(steps[:, 2])
    is_known = (known_ns[before] <= stamps_ns) & (stamps_ns <= known_ns[after]) & (gaps_ns <= LONGEST_GAP_NS)
    return poses[before] + share[:, np.newaxis] * steps, is_known


def _stretch_ends(steps_m: np.ndarray, distance_m: float) -> List[int]:
    """Indices of poses between which the path is as long, or just longer; from the first pose."""
    ends, since_m = [0], 0.0
    for index, step_m in enumerate(steps_m.tolist(), start=1):
        since_m += step_m
        if since_m >= distance_m:
            ends.append(index)
            since_m = 0.0
    return ends


def _motions(poses: np.ndarray) -> np.ndarray:
    """(n - 1, 3) each pose as seen from the one before; yaw is not wrapped."""
    steps, yaws_rad = np.diff(poses, axis=0), poses[:-1, 2]
    cos_yaw, sin_yaw = np.cos(yaws_rad), np.sin(yaws_rad)
    return np.column_stack(
        (cos_yaw * steps[:, 0] + sin_yaw * steps[:, 1], cos_yaw * steps[:, 1] - sin_yaw * steps[:, 0], steps[:, 2])
    )


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
