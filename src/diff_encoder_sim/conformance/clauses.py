"""Common parts of the clauses: tolerances with their reasons, the evidence, and comparison with exact poses."""

from __future__ import annotations

import math
from typing import Callable, Dict, Iterable, List, NamedTuple, Sequence, Tuple

import numpy as np

from diff_encoder_sim.conformance.mapping import NodeMapping, Wheels
from diff_encoder_sim.conformance.recording import FramedPose, Recording
from diff_encoder_sim.conformance.reference import pose_errors

# Tolerances, with their reasons.
ARITHMETIC_M, ARITHMETIC_RAD = 1e-3, 2e-3  # sums of thousands of float32 numbers
ARC_ERROR = 1e-3  # of the path: a chord at half of the turn (midpoint rule) passes, one at the first heading does not
ROUNDING_COUNTS = 2.0  # each wheel by one: nodes may integrate other samples of the same arc


class NotApplicable(Exception):
    """A clause cannot be judged; the reason."""


def require(is_met: object, reason: str) -> None:
    """Raise NotApplicable with a reason unless a condition holds."""
    if not is_met:
        raise NotApplicable(reason)


class Measured(NamedTuple):
    """Result of a clause."""

    is_met: bool
    value: str
    allowed: str
    case: str = ''  # the worst one, whose messages are kept


class Evidence(NamedTuple):
    """All that is known of a node."""

    mapping: NodeMapping
    wheels: Wheels
    recordings: Sequence[Recording]
    unusable: str = ''
    has_stamps: bool = True  # of the input
    missing: str = 'needs a start, stamps of the input, and prompt answers'  # why a case was not played

    @property
    def motions(self) -> List[Recording]:
        """Return the recordings of motions with an answer; NotApplicable if there are none."""
        return self.some(each for each in self.recordings if each.case.is_motion and not each.has_ended)

    @property
    def orderly(self) -> List[Recording]:
        """Return the recordings in which neither time nor counters nor samples are wrong."""
        return self.some(each for each in self.recordings if each.case.is_orderly and not each.has_ended)

    def named(self, prefix: str) -> List[Recording]:
        """Return the recordings of cases whose name begins so; NotApplicable if there are none."""
        return self.some(each for each in self.recordings if each.name.startswith(prefix) and not each.has_ended)

    def some(self, found: Iterable[Recording]) -> List[Recording]:
        """Return recordings; NotApplicable if there are none."""
        recordings = list(found)
        require(recordings, self.missing)
        return recordings

    def pose_limits(self, recording: Recording) -> Tuple[float, float]:
        """Return the allowed errors of position [m] and heading [rad] at the end of a recording."""
        path_m = float(abs(np.diff(recording.travels_m.mean(axis=1))).sum())
        rounding_m = ROUNDING_COUNTS * self.wheels.m_per_count if self.mapping.is_exact else 0.0
        slack_rad = 2.0 * recording.slack_m / self.wheels.wheel_separation
        slack_m = recording.slack_m + slack_rad * path_m
        return ARITHMETIC_M + ARC_ERROR * path_m + rounding_m + slack_m, ARITHMETIC_RAD + slack_rad

    def end_errors(self, recording: Recording) -> Tuple[float, float]:
        """Return the errors of position [m] and heading [rad] at the end; infinite without an answer."""
        if not recording.odometry or recording.fault:
            return math.inf, math.inf
        return pose_errors(recording.found()[-1], recording.expected(self.wheels.wheel_separation)[-1])

    def worst_end(self, recordings: Sequence[Recording], slack_m: float = 0.0, slack_rad: float = 0.0) -> Measured:
        """Compare the poses at the ends of recordings with exact arcs."""
        excesses = []
        for recording in recordings:
            limits, errors = self.pose_limits(recording), self.end_errors(recording)
            limits = limits[0] + slack_m, limits[1] + slack_rad
            excess = max(error / limit for error, limit in zip(errors, limits))
            excesses.append((math.inf if math.isnan(excess) else excess, recording.name, errors, limits))
        excess, name, (off_m, off_rad), (limit_m, limit_rad) = max(excesses)
        value = f'{name}: {pose_text(off_m, off_rad)}' if math.isfinite(off_m) else f'{name}: no pose'
        return Measured(excess <= 1.0, value, pose_text(limit_m, limit_rad), name)


def pose_text(off_m: float, off_rad: float) -> str:
    """Return a distance and an angle for people."""
    distance = f'{1000.0 * off_m:.1f} mm' if off_m < 1.0 else f'{off_m:.2f} m'
    return f'{distance}, {degrees(off_rad)}'


def degrees(angle_rad: float) -> str:
    """Return an angle for people."""
    return f'{math.degrees(angle_rad):.2f}°'


def not_ascending(messages: Sequence[FramedPose]) -> int:
    """Return how many stamps repeat, or go back."""
    stamps_ns = np.array([message.stamp_ns for message in messages], np.int64)
    return int((np.diff(stamps_ns) <= 0).sum())


def rounding_of(evidence: Evidence) -> Tuple[float, float]:
    """Return the distance [m] and the angle [rad] of float32 and of one count of each wheel."""
    count_m = ROUNDING_COUNTS * evidence.wheels.m_per_count
    return ARITHMETIC_M + count_m, ARITHMETIC_RAD + count_m / evidence.wheels.wheel_separation


def at_zero(evidence: Evidence, poses: Sequence[Tuple[np.ndarray, str]]) -> Measured:
    """Judge poses that should be zero, with the names of their cases."""
    off_m, off_rad, name = max((*pose_errors(pose, np.zeros(3)), name) for pose, name in poses)
    limit_m, limit_rad = rounding_of(evidence)
    is_met = off_m <= limit_m and off_rad <= limit_rad
    return Measured(is_met, pose_text(off_m, off_rad), pose_text(limit_m, limit_rad), name)


Measures = Dict[str, Callable[[Evidence], Measured]]  # by the number of the clause
