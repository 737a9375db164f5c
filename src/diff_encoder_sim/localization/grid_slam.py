"""Grid SLAM by a Rao-Blackwellised particle filter, without ROS and without a clock.

Each particle is a path of the robot with the map that the scans make along it. Grisetti, Stachniss
and Burgard, "Improved Techniques for Grid Mapping with Rao-Blackwellized Particle Filters", IEEE
Transactions on Robotics 23 (2007), algorithm 1; parameters and output are slam_gmapping's.
"""

from __future__ import annotations

import logging
import math
from bisect import bisect_left
from typing import Iterable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, interpolate
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.localization.histogram import effective_count
from diff_encoder_sim.localization.map_update import Rays, update_maps, usable_rays
from diff_encoder_sim.localization.occupancy_grid import UNKNOWN, OccupancyGrid, occupancy
from diff_encoder_sim.localization.particles import check_pose
from diff_encoder_sim.localization.patches import SIDE, Extent, PatchMaps
from diff_encoder_sim.localization.proposal import propose
from diff_encoder_sim.localization.slam_params import (
    GridSlamParams,
    apply_moves,
    entropy_of,
    normalised,
    systematic_indices,
)


class TrajectoryPose(NamedTuple):
    """The pose of the base when a scan was added to the map."""

    stamp_ns: int
    base_pose_in_map: Pose2D


# Margin beyond the range of the rays for the search of scan matching.
MATCH_MARGIN_M = 1.0


class SlamEstimate(NamedTuple):
    """The best particle's pose after a scan was added to the maps, and the filter's state."""

    stamp_ns: int  # the scan's
    base_pose_in_map: Pose2D
    odom_pose_in_map: Pose2D  # the transform map->odom that corresponds to base_pose_in_map
    entropy: float  # of the weights before resampling [nat]
    effective_count: float  # effective sample size before resampling
    has_resampled: bool


class GridSlam:
    """The mapper; pass every scan with the odometry pose at its stamp.

    The map frame is odom's as it was on the first scan, unless a start is given. Every random draw
    comes from `rng`: equal seeds and inputs give equal results, bit for bit.
    """

    def __init__(
        self, params: GridSlamParams, rng: np.random.Generator, start_pose_in_map: Optional[Pose2D] = None
    ) -> None:
        """Start with empty maps; `start_pose_in_map` is the base's pose at the first scan, if known."""
        self.params = params
        self._start_pose = start_pose_in_map
        self._rng = rng
        extent = Extent(params.xmin, params.ymin, params.xmax, params.ymax)
        self.maps = PatchMaps(extent, params.delta, params.particles)
        self._particles = np.empty((0, 3))
        self._log_weights = np.zeros(params.particles)
        # Over the whole path; not reset by resampling, unlike the weights.
        self._log_path_weights = np.zeros(params.particles)
        self._trend = np.zeros(3)  # of the scans' offsets from odometry
        # Of each update: its stamp, all particles (n, 3), and each one's index in the update before (n,).
        self._history: List[Tuple[int, np.ndarray, np.ndarray]] = []
        self._parents = np.arange(params.particles)
        self._estimate: Optional[SlamEstimate] = None
        self._odom_pose: Optional[Pose2D] = None  # at the last added scan
        self._entered_ns = 0  # stamp of that scan
        self._newest_ns: Optional[int] = None  # stamp of the newest scan, added or not

    # State

    @property
    def particles(self) -> np.ndarray:
        """(n, 3) base poses in the map, x [m], y [m], yaw [rad]; empty before the first scan."""
        return self._particles

    @property
    def weights(self) -> np.ndarray:
        """(n,) weights of the particles, sum 1."""
        return normalised(self._log_weights)

    @property
    def last_estimate(self) -> Optional[SlamEstimate]:
        """The newest estimate, None before the first scan."""
        return self._estimate

    @property
    def odom_pose_in_map(self) -> Optional[Pose2D]:
        """The transform map->odom to broadcast, None before the first scan."""
        return self._estimate.odom_pose_in_map if self._estimate else None

    @property
    def trajectory(self) -> List[TrajectoryPose]:
        """The best particle's pose at each added scan, oldest first."""
        path, particle = [], int(self._parents[self._best()])
        for stamp_ns, poses, parents in reversed(self._history):
            path.append(TrajectoryPose(stamp_ns, Pose2D(*poses[particle].tolist())))
            particle = int(parents[particle])
        return path[::-1]

    def map(self) -> OccupancyGrid:
        """Return the best particle's map: 0, 100 or -1.

        It covers xmin to xmax and ymin to ymax, in whole patches, and observed cells beyond.
        """
        rows, columns = self.maps.table.shape[1:]
        cells = np.full((rows * SIDE, columns * SIDE), UNKNOWN, np.int8)
        hits, visits, row, column = self.maps.counts(self._best())
        cells[row : row + hits.shape[0], column : column + hits.shape[1]] = occupancy(
            hits, visits, self.params.occ_thresh
        )
        return OccupancyGrid(cells, self.params.delta, Pose2D(self.maps.origin_x_m, self.maps.origin_y_m, 0.0))

    # The filter

    def update(self, odom_pose: Pose2D, scan: Scan, laser_pose_in_base: Pose2D) -> Optional[SlamEstimate]:
        """Process a scan; return an estimate if it was added to the map, else None.

        The first scan is added, and each scan after a motion of linearUpdate or angularUpdate or a time of
        temporalUpdate. Upstream sums the odometry increments, which grow with the heading jitter of a
        coarse encoder; here only the pose counts.

        Args:
            odom_pose: base in odom at the scan's stamp.
            scan: ranges that are NaN, infinite or out of range are allowed.
            laser_pose_in_base: mounting pose of the laser, not upside-down.

        Raises:
            InputFault: the scan, pose or mount cannot be used, or time went back. The map is
                unchanged.
        """
        check_pose(odom_pose, 'odometry pose')
        check_pose(laser_pose_in_base, 'laser pose')
        rays = usable_rays(scan, laser_pose_in_base, self.params)
        if self._newest_ns is not None and scan.stamp_ns < self._newest_ns:
            now_s, newest_s = scan.stamp_ns / NANOSECONDS_PER_SECOND, self._newest_ns / NANOSECONDS_PER_SECOND
            raise InputFault(
                f'stamp of {now_s:.3f} s after one of {newest_s:.3f} s: time went back; the map so far is kept'
            )
        self._newest_ns = scan.stamp_ns
        if self._odom_pose is None:
            return self._begin(odom_pose, scan.stamp_ns, rays)
        params, move = self.params, odom_pose.relative_to(self._odom_pose)
        waited_s = (scan.stamp_ns - self._entered_ns) / NANOSECONDS_PER_SECOND
        if (
            math.hypot(move.x_m, move.y_m) < params.linearUpdate
            and abs(move.yaw_rad) < params.angularUpdate
            and not 0.0 <= params.temporalUpdate < waited_s
        ):
            return None
        # Algorithm 1 up to the resampling, with its line numbers.
        self._cover(apply_moves(self._particles, np.array(move)), rays)
        proposed = propose(self.maps, self._particles, move, rays, params, self._rng, self._trend)
        self._particles, self._trend = proposed.particles, proposed.trend  # 4 to 23
        self._log_weights = self._log_weights + proposed.log_factors  # 24
        self._log_path_weights = self._log_path_weights + proposed.log_factors
        self._update_maps(rays)  # 26
        return self._finish(odom_pose, scan.stamp_ns, may_resample=True)

    def _begin(self, odom_pose: Pose2D, stamp_ns: int, rays: Rays) -> SlamEstimate:
        start_pose = odom_pose if self._start_pose is None else self._start_pose
        self._particles = np.tile(np.array(start_pose), (self.params.particles, 1))
        self._update_maps(rays)
        # The maps are equal: one patch serves all.
        self.maps.resample(np.zeros(self.params.particles, int))
        return self._finish(odom_pose, stamp_ns, may_resample=False)

    def _finish(self, odom_pose: Pose2D, stamp_ns: int, may_resample: bool) -> SlamEstimate:
        """Record the step, and resample when few particles count (lines 29 to 32)."""
        self._odom_pose, self._entered_ns = odom_pose, stamp_ns
        self._history.append((stamp_ns, self._particles, self._parents))
        weights = self.weights
        count = effective_count(weights)
        is_due = may_resample and count < self.params.resampleThreshold * len(weights)
        kept = systematic_indices(weights, self._rng) if is_due else np.arange(len(weights))
        # Of the resampled particles: the previous best path may have become unlikely.
        best = kept[np.argmax(self._log_path_weights[kept])]
        base_pose = Pose2D(*self._particles[best].tolist())
        odom_pose_in_map = base_pose.compose(odom_pose.inverse())
        estimate = SlamEstimate(stamp_ns, base_pose, odom_pose_in_map, entropy_of(weights), count, is_due)
        self._estimate = estimate
        self._parents = kept
        if is_due:
            self._particles, self._log_weights = self._particles[kept], np.zeros(len(kept))
            self._log_path_weights = self._log_path_weights[kept]
            self.maps.resample(kept)
        return estimate

    def _update_maps(self, rays: Rays) -> None:
        self._cover(self._particles, rays)
        update_maps(self.maps, self._particles, rays)

    def _cover(self, particles: np.ndarray, rays: Rays) -> None:
        """Enlarge the maps to the reach of all rays from the particles."""
        reach_m = rays.reach_m() + MATCH_MARGIN_M
        lowest, highest = particles[:, :2].min(axis=0), particles[:, :2].max(axis=0)
        self.maps.cover(Extent(*(lowest - reach_m).tolist(), *(highest + reach_m).tolist()))

    def _best(self) -> int:
        """Return the particle with the likeliest path."""
        return int(np.argmax(self._log_path_weights))


log = logging.getLogger(__name__)


def map_recording(slam: GridSlam, odometry: OdometryTrack, scans: Iterable[Scan], laser_pose_in_base: Pose2D) -> int:
    """Process a recording; return the number of scans that were added to the map.

    Each throttle_scans-th scan is used. Scans outside of odometry's time span, scans older than the
    previous one, and invalid scans are dropped with a warning.

    Args:
        slam: new, or with a map to continue.
        odometry: of the whole drive.
        scans: in the order of their stamps.
        laser_pose_in_base: mounting pose of the laser.

    Raises:
        ConfigError: no odometry, or no usable scan.
    """
    if not odometry.stamps_ns:
        raise ConfigError('no odometry for the scans; allowed: a recording of both')
    given = entered = 0
    for given, scan in enumerate(scans, 1):
        if (given - 1) % slam.params.throttle_scans:
            continue
        try:
            entered += slam.update(odometry.at(scan.stamp_ns), scan, laser_pose_in_base) is not None
        except InputFault as fault:
            log.warning('scan at %.3f s dropped: %s', scan.stamp_ns / NANOSECONDS_PER_SECOND, fault)
    if not given:
        raise ConfigError('no scans for the odometry; allowed: a recording of both')
    if slam.last_estimate is None:
        raise ConfigError(f'none of {given} scans could be used: see the warnings')
    return entered


class OdometryTrack:
    """Odometry poses by time."""

    def __init__(self, stamps_ns: Sequence[int], base_poses_in_odom: Sequence[Pose2D]) -> None:
        """Store poses in recorded order, up to a jump back in time, which logs a warning."""
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


RAYS, PARTICLES = 60, 2


def warm_up(params: GridSlamParams) -> None:
    """Map a small room: takes tenths of a second with numba's cache, else seconds."""
    few = params.model_copy(update={'particles': PARTICLES, 'linearUpdate': 0.0})
    slam = GridSlam(few, np.random.default_rng(0))
    scan = Scan(0, -math.pi, 2.0 * math.pi / RAYS, 0.1, 10.0, np.full(RAYS, 2.0))
    for stamp_ns in range(2):
        slam.update(IDENTITY, scan._replace(stamp_ns=stamp_ns), IDENTITY)
