"""Offline mapping: a recorded drive's odometry and scans, as fast as the processor allows."""

from __future__ import annotations

import logging
from bisect import bisect_left
from typing import Iterable, Sequence

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D, interpolate
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.localization.grid_slam import GridSlam

log = logging.getLogger(__name__)


def map_recording(slam: GridSlam, odometry: OdometryTrack, scans: Iterable[Scan], laser_pose_in_base: Pose2D) -> int:
    """Feed a recording to a mapper; return how many scans were entered into the map.

    Each throttle_scans-th scan is taken. A scan outside of odometry's time span, older than the
    one before, or unusable otherwise, is left out with a warning.

    Args:
        slam: new, or with a map to continue.
        odometry: of the whole drive.
        scans: in the order of their stamps.
        laser_pose_in_base: where the laser is mounted.

    Raises:
        ConfigError: there is no odometry, no scan, or none that can be used.
    """
    if not odometry.stamps_ns:
        raise ConfigError('no odometry for the scans; allowed: a recording of both')
    given = entered = 0
    for given, scan in enumerate(scans, 1):
        if (given - 1) % slam.params.throttle_scans == 0:
            entered += _enter(slam, odometry, scan, laser_pose_in_base)
    if not given:
        raise ConfigError('no scans for the odometry; allowed: a recording of both')
    if slam.last_estimate is None:
        raise ConfigError(f'none of {given} scans could be used: see the warnings')
    return entered


def _enter(slam: GridSlam, odometry: OdometryTrack, scan: Scan, laser_pose_in_base: Pose2D) -> bool:
    """Feed one scan; return whether it was entered into the map."""
    try:
        return slam.update(odometry.at(scan.stamp_ns), scan, laser_pose_in_base) is not None
    except InputFault as fault:
        log.warning('scan at %.3f s dropped: %s', scan.stamp_ns / NANOSECONDS_PER_SECOND, fault)
        return False


class OdometryTrack:
    """Odometry's poses by time."""

    def __init__(self, stamps_ns: Sequence[int], base_poses_in_odom: Sequence[Pose2D]) -> None:
        """Take poses in recorded order, up to where time goes back, with a warning if it does."""
        backward = (index for index in range(1, len(stamps_ns)) if stamps_ns[index] < stamps_ns[index - 1])
        end = next(backward, len(stamps_ns))
        if end < len(stamps_ns):
            log.warning(
                'odometry stamps go back to %.3f s: only the drive before that is mapped',
                stamps_ns[end] / NANOSECONDS_PER_SECOND,
            )
        self.stamps_ns, self._poses = list(stamps_ns[:end]), list(base_poses_in_odom[:end])

    def at(self, stamp_ns: int) -> Pose2D:
        """Return the pose at a time, interpolated.

        Raises:
            InputFault: the time is before the first pose or after the last.
        """
        after = bisect_left(self.stamps_ns, stamp_ns)
        if after < len(self.stamps_ns) and self.stamps_ns[after] == stamp_ns:
            return self._poses[after]
        if not 0 < after < len(self.stamps_ns):
            raise InputFault('no odometry at its stamp')
        start, end = self._poses[after - 1], self._poses[after]
        fraction = (stamp_ns - self.stamps_ns[after - 1]) / (self.stamps_ns[after] - self.stamps_ns[after - 1])
        return interpolate(start, end, fraction)
