"""AMCL in lockstep, as amcl_node and /tf have it live."""

from __future__ import annotations

import logging
from collections import deque
from typing import Callable, Deque, Optional

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, interpolate
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.localization.amcl import Amcl, AmclEstimate
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.trials.latency import latency_ns
from diff_encoder_sim.trials.publications import Publications
from diff_encoder_sim.trials.robot_params import RobotParams
from diff_encoder_sim.trials.schedule import Schedule
from diff_encoder_sim.wheels.odometry import OdometryEstimate

log = logging.getLogger(__name__)

# Takes map->odom with its stamp [ns].
TakeLocalization = Callable[[int, Pose2D], None]


class Localizer:
    """Localizes by each scan as soon as odometry has come to it, and publishes the result after the latency."""

    def __init__(
        self,
        trial: Trial,
        params: RobotParams,
        grid: OccupancyGrid,
        laser_pose_in_base: Pose2D,
        schedule: Schedule,
        publications: Publications,
        take_localization: TakeLocalization,
    ) -> None:
        start = trial.test.start
        at_start = {'initial_pose_x': start.x, 'initial_pose_y': start.y, 'initial_pose_a': start.yaw}
        self._amcl = Amcl(params.amcl.model_copy(update=at_start), grid, generator(trial.number, 'amcl'))
        self._tolerance_ns = latency_ns(params.amcl.transform_tolerance)
        self._latency_ns = latency_ns(params.latency.localization)
        self._laser_pose_in_base = laser_pose_in_base
        self._schedule, self._publications, self._take_localization = schedule, publications, take_localization
        self._scans: Deque[Scan] = deque()  # newer than the newest odometry
        self._is_scan_bad = False
        self._odometry: Optional[OdometryEstimate] = None
        self._odom_pose_in_map, self._localized_until_ns = IDENTITY, -1  # as /tf has it

    @property
    def last_estimate(self) -> Optional[AmclEstimate]:
        """Return AMCL's newest estimate, None before the first."""
        return self._amcl.last_estimate

    @property
    def is_lost(self) -> bool:
        """Return whether AMCL has found the robot to be lost."""
        return self._amcl.is_lost

    def pose_in_map(self, odometry: OdometryEstimate) -> Optional[Pose2D]:
        """Return the base's pose in the map by the newest map->odom, None where that is too old."""
        if odometry.stamp_ns > self._localized_until_ns:
            return None
        return self._odom_pose_in_map.compose(odometry.base_pose_in_odom)

    def take_scan(self, scan: Scan) -> None:
        """Keep a scan until odometry has come to it."""
        self._scans.append(scan)

    def take_odometry(self, now_ns: int, estimate: OdometryEstimate) -> None:
        """Localize by the scans that odometry has come to."""
        while self._scans and self._scans[0].stamp_ns <= estimate.stamp_ns:
            self._localize(now_ns, self._scans.popleft(), estimate)
        self._odometry = estimate

    def _localize(self, now_ns: int, scan: Scan, odometry: OdometryEstimate) -> None:
        pose = self._odom_pose_at(scan.stamp_ns, odometry)
        if pose is None:
            return
        try:
            estimate = self._amcl.update(pose, scan, self._laser_pose_in_base)
        except InputFault as fault:
            if not self._is_scan_bad:
                log.warning('scan dropped: %s (bad scans that follow it directly are not reported)', fault)
            self._is_scan_bad = True
            return
        self._is_scan_bad = False
        odom_pose_in_map = None if self._amcl.is_lost else self._amcl.odom_pose_in_map
        published_ns = now_ns + self._latency_ns
        self._schedule.at(published_ns, lambda: self._publish(published_ns, scan.stamp_ns, estimate, odom_pose_in_map))

    def _odom_pose_at(self, stamp_ns: int, newest: OdometryEstimate) -> Optional[Pose2D]:
        """Interpolate between the newest two estimates, as tf2 does; None before the first."""
        if stamp_ns == newest.stamp_ns:
            return newest.base_pose_in_odom
        if self._odometry is None:
            return None
        fraction = (stamp_ns - self._odometry.stamp_ns) / (newest.stamp_ns - self._odometry.stamp_ns)
        return interpolate(self._odometry.base_pose_in_odom, newest.base_pose_in_odom, fraction)

    def _publish(
        self, now_ns: int, stamp_ns: int, estimate: Optional[AmclEstimate], odom_pose_in_map: Optional[Pose2D]
    ) -> None:
        if estimate is not None:
            self._publications.amcl_pose(now_ns, estimate)
        if odom_pose_in_map is not None:
            # Stamped in the future, as by upstream: it holds for newer odometry until the next scan.
            self._localized_until_ns = stamp_ns + self._tolerance_ns
            self._odom_pose_in_map = odom_pose_in_map
            self._publications.odom_in_map(now_ns, self._localized_until_ns, odom_pose_in_map)
            self._take_localization(self._localized_until_ns, odom_pose_in_map)
