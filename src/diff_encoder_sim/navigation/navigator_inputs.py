"""Inputs of the navigator: the newest odometry, localization and scan, and which of them are missing."""

from __future__ import annotations

import enum
import math
from collections import deque
from typing import Deque, NamedTuple, Optional, Tuple

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, interpolate
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND


class ControlRate:
    """Selects odometry stamps to control at, by a rate, or all of slower odometry; allows jitter of half a period."""

    def __init__(self, frequency_hz: float) -> None:
        self._period_ns = round(NANOSECONDS_PER_SECOND / frequency_hz)
        self._due_ns: Optional[int] = None

    def is_due(self, stamp_ns: int) -> bool:
        """Return whether to control at this stamp; always True after time has jumped back."""
        period_ns, due_ns = self._period_ns, stamp_ns if self._due_ns is None else self._due_ns
        if period_ns // 2 < due_ns - stamp_ns <= 2 * period_ns:
            return False
        self._due_ns = (due_ns if abs(stamp_ns - due_ns) < period_ns else stamp_ns) + period_ns
        return True


class GoalStatus(enum.Enum):
    """Status of a goal, as in actionlib; the values are for messages to people."""

    NONE = 'no goal'
    ACTIVE = 'active'
    SUCCEEDED = 'goal reached'
    ABORTED = 'aborted'
    PREEMPTED = 'cancelled'

    @property
    def is_over(self) -> bool:
        """Return whether the goal has ended."""
        return self not in (GoalStatus.NONE, GoalStatus.ACTIVE)


class Phase(enum.Enum):
    """Phase of an active goal: move_base's states."""

    PLANNING = 'planning'
    CONTROLLING = 'controlling'
    CLEARING = 'clearing'


class Trigger(enum.Enum):
    """Reason for a recovery."""

    PLANNING = 'no plan was found'
    CONTROLLING = 'no velocity command was found'
    OSCILLATION = 'the robot made no progress'


class Command(NamedTuple):
    """Velocity command, as published on /cmd_vel."""

    linear_mps: float
    angular_radps: float


STOP = Command(0.0, 0.0)


class StartedRecovery(NamedTuple):
    """The start of a recovery behaviour, with its number from 0 among all."""

    name: str
    number: int
    total: int


class NavigatorOutput(NamedTuple):
    """Result of one control period."""

    command: Command  # zero without an active goal or during a stop
    status: GoalStatus
    phase: Phase  # meaningful while the status is ACTIVE
    text: str  # one line for users: current action, or why the goal ended
    started_recovery: Optional[StartedRecovery] = None  # in the period in which a behaviour starts


HISTORY_NS = 2 * NANOSECONDS_PER_SECOND  # of odometry, for scans that wait for transforms
MOST_AHEAD_S = 2.0  # AMCL post-dates its transform by a second at most; the stamp of another clock would never expire
FARTHEST_M = 1e9  # cell indices of larger coordinates would overflow


class OdometrySample(NamedTuple):
    """Contents of one odometry message."""

    stamp_ns: int
    base_pose_in_odom: Pose2D
    linear_mps: float
    angular_radps: float
    linear_std_mps: float = 0.0  # from the message's covariance; 0: unknown
    angular_std_radps: float = 0.0


class MissingInput(NamedTuple):
    """An input that has not been received or is not usable: its name, and the rest of the sentence."""

    what: str
    why: str

    def __str__(self) -> str:
        return f'{self.what} {self.why}'


class NavigatorInputs:
    """Newest odometry, localization and scan. A message rejected with an InputFault has no effect."""

    def __init__(self, laser_pose_in_base: Pose2D) -> None:
        self.laser_pose_in_base = laser_pose_in_base
        self.forget_inputs()

    def forget_inputs(self) -> None:
        """Clear all messages."""
        self._odometry: Deque[OdometrySample] = deque()
        self._localized_ns: Optional[int] = None
        self._odom_pose_in_map: Optional[Pose2D] = None
        self.scan: Optional[Scan] = None
        self._scan_pose_in_base = self.laser_pose_in_base

    def take_odometry(self, sample: OdometrySample) -> None:
        """Add /odom, unless its stamp is old; raise InputFault for a number that is not finite or too large."""
        _check('odometry', sample.base_pose_in_odom, sample[2:])
        samples = self._odometry
        if not samples or sample.stamp_ns > samples[-1].stamp_ns:
            samples.append(sample)
            while samples[0].stamp_ns < sample.stamp_ns - HISTORY_NS:
                samples.popleft()

    def take_localization(self, stamp_ns: int, odom_pose_in_map: Pose2D) -> None:
        """Add the transform map->odom, post-dated or not; raise InputFault for a bad number as `take_odometry`."""
        _check('the transform map->odom', odom_pose_in_map)
        self._localized_ns, self._odom_pose_in_map = stamp_ns, odom_pose_in_map

    def take_scan(self, scan: Scan, laser_pose_in_base: Optional[Pose2D] = None) -> None:
        """Add /scan, taken at a laser pose or the default one; raise InputFault without valid ranges and directions."""
        low_m, high_m = scan.range_min_m, scan.range_max_m
        _check('the scan', IDENTITY, (scan.angle_min_rad, scan.angle_increment_rad, low_m, high_m))
        # In open space all ranges are +inf; a covered laser sends no valid ones.
        if not any(low_m <= range_m <= high_m or range_m == math.inf for range_m in scan.ranges_m):
            valid = f'from {low_m:g} to {high_m:g} m, or +inf for no return'
            raise InputFault(f'none of {len(scan.ranges_m)} ranges is valid: {valid}')
        self.scan, self._scan_pose_in_base = scan, laser_pose_in_base or self.laser_pose_in_base

    @property
    def odometry(self) -> OdometrySample:
        """Return the newest odometry; only when nothing is missing."""
        return self._odometry[-1]

    @property
    def odom_pose_in_map(self) -> Pose2D:
        """Return the newest transform map->odom; only when nothing is missing."""
        assert self._odom_pose_in_map is not None
        return self._odom_pose_in_map

    @property
    def has_pose(self) -> bool:
        """Return whether a `base_pose_in_map` of any age exists."""
        return bool(self._odometry) and self._odom_pose_in_map is not None

    @property
    def base_pose_in_map(self) -> Pose2D:
        """Return the localized pose; only when `has_pose`."""
        return self.odom_pose_in_map.compose(self._odometry[-1].base_pose_in_odom)

    def laser_pose_in_odom(self) -> Pose2D:
        """Return the laser's pose at the newest scan's stamp, interpolated between odometry or from the closest."""
        assert self.scan is not None
        stamp_ns, sample, after = self.scan.stamp_ns, self._odometry[-1], None
        for sample in reversed(self._odometry):
            if sample.stamp_ns <= stamp_ns:
                break
            after = sample
        pose = sample.base_pose_in_odom
        if after is not None and sample.stamp_ns < stamp_ns:
            fraction = (stamp_ns - sample.stamp_ns) / (after.stamp_ns - sample.stamp_ns)
            pose = interpolate(pose, after.base_pose_in_odom, fraction)
        return pose.compose(self._scan_pose_in_base)

    def missing(self, now_ns: int, timeout_s: float) -> Optional[MissingInput]:
        """Return the first input that has not been received or is too old; None if all are fresh."""
        stamps = {
            'odometry': self._odometry[-1].stamp_ns if self._odometry else None,
            'localization (map->odom)': self._localized_ns,
            'scan': self.scan.stamp_ns if self.scan else None,
        }
        for name, stamp_ns in stamps.items():
            if stamp_ns is None:
                return MissingInput(name, 'has not been received yet')
            age_s = (now_ns - stamp_ns) / NANOSECONDS_PER_SECOND
            if age_s > timeout_s:
                return MissingInput(name, f'is {age_s:.1f} s old (input_timeout {timeout_s:g} s)')
            if -age_s > MOST_AHEAD_S:
                return MissingInput(name, f'is dated {-age_s:.1f} s ahead of the clock')
        return None


def _check(what: str, pose: Pose2D, values: Tuple[float, ...] = ()) -> None:
    if not all(map(math.isfinite, (*pose, *values))):
        raise InputFault(f'{what} has a number that is not finite: {(*pose, *values)}')
    if max(abs(pose.x_m), abs(pose.y_m)) > FARTHEST_M:
        raise InputFault(f'{what} is at ({pose.x_m:g}, {pose.y_m:g}) m; allowed: within {FARTHEST_M:g} m')
