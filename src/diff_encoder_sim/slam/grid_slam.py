"""Grid SLAM by a Rao-Blackwellised particle filter, without ROS and without a clock.

Each particle is a path of the robot with the map that the scans make along it. Grisetti, Stachniss
and Burgard, "Improved Techniques for Grid Mapping with Rao-Blackwellized Particle Filters", IEEE
Transactions on Robotics 23 (2007), algorithm 1; parameters and output are slam_gmapping's.
"""

from __future__ import annotations

import math
from typing import List, NamedTuple, Optional

import numpy as np

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.localization.kld_resampling import effective_count
from diff_encoder_sim.localization.particles import check_pose
from diff_encoder_sim.mapping.occupancy_grid import UNKNOWN, OccupancyGrid
from diff_encoder_sim.slam.history import History, TrajectoryPose
from diff_encoder_sim.slam.map_update import update_maps
from diff_encoder_sim.slam.move_noise import apply_moves
from diff_encoder_sim.slam.occupancy import occupancy
from diff_encoder_sim.slam.patches import SIDE, Extent, PatchMaps
from diff_encoder_sim.slam.proposal import propose
from diff_encoder_sim.slam.rays import Rays, usable_rays
from diff_encoder_sim.slam.slam_params import GridSlamParams
from diff_encoder_sim.slam.systematic_resampling import entropy_of, normalised, systematic_indices

# Room for scan matching to look around the expected pose, beyond what the rays reach.
MATCH_MARGIN_M = 1.0


class SlamEstimate(NamedTuple):
    """The filter after a scan was entered, by its best particle."""

    stamp_ns: int  # the scan's
    base_pose_in_map: Pose2D
    odom_pose_in_map: Pose2D  # the transform map->odom that makes base_pose_in_map true
    entropy: float  # of the weights before they were redrawn [nat]
    effective_count: float  # how many equally weighted particles would say as much
    has_resampled: bool
    score: float  # of the best particle's match; 0 on the first scan


class GridSlam:
    """The mapper: feed it every scan with the odometry's pose at the scan's time.

    The map frame is odom's as it was on the first scan, unless a start is given. Every random draw
    comes from `rng`: equal seeds and inputs give equal results, bit for bit.
    """

    def __init__(
        self, params: GridSlamParams, rng: np.random.Generator, start_pose_in_map: Optional[Pose2D] = None
    ) -> None:
        """`start_pose_in_map` is where the base is on the first scan, if somebody knows."""
        self.params = params
        self._start_pose = start_pose_in_map
        self._rng = rng
        self.maps = PatchMaps(
            Extent(params.xmin, params.ymin, params.xmax, params.ymax), params.delta, params.particles
        )
        self._log_weights = np.zeros(params.particles)
        # Over the whole path; redrawing makes the weights equal, but not these.
        self._log_path_weights = np.zeros(params.particles)
        self._history = History()
        self._parents = np.arange(params.particles)
        self._estimate: Optional[SlamEstimate] = None
        self._odom_pose: Optional[Pose2D] = None
        self._newest_ns: Optional[int] = None

    # What it tells.

    @property
    def particles(self) -> np.ndarray:
        """(n, 3) base poses in the map, x [m], y [m], yaw [rad]; empty before the first scan."""
        return np.empty((0, 3)) if self._odom_pose is None else self._particles

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
    def entropy(self) -> Optional[float]:
        """Of the particles' weights [nat], for ~entropy; None before the first scan."""
        return self._estimate.entropy if self._estimate else None

    @property
    def trajectory(self) -> List[TrajectoryPose]:
        """Where the best particle was at each scan that was entered, oldest first."""
        return self._history.path(int(self._parents[self._best()]))

    def map(self) -> OccupancyGrid:
        """The map of the best particle: 0, 100 or -1.

        It covers xmin to xmax and ymin to ymax, in whole patches, and more once more was seen.
        """
        rows, columns = self.maps.table.shape[1:]
        cells = np.full((rows * SIDE, columns * SIDE), UNKNOWN, np.int8)
        hits, visits, row, column = self.maps.counts(self._best())
        cells[row : row + hits.shape[0], column : column + hits.shape[1]] = occupancy(
            hits, visits, self.params.occ_thresh
        )
        return OccupancyGrid(cells, self.params.delta, Pose2D(self.maps.origin_x_m, self.maps.origin_y_m, 0.0))

    # The filter.

    def update(self, odom_pose: Pose2D, scan: Scan, laser_pose_in_base: Pose2D) -> Optional[SlamEstimate]:
        """Take one scan; an estimate when it was entered into the map, else None.

        The first one is, and each that was taken linearUpdate, angularUpdate or temporalUpdate
        from the last. Upstream adds up how far odometry went in between, and from coarse encoders
        each pulse turns to and fro; here the place alone counts.

        Args:
            odom_pose: base in odom at the scan's stamp.
            scan: ranges that are NaN, infinite or out of range are allowed.
            laser_pose_in_base: where the laser is mounted, upside-down excluded.

        Raises:
            InputFault: the scan, pose or mount cannot be used, or time went back. The map is as
                before.
        """
        check_pose(odom_pose, 'odometry pose')
        check_pose(laser_pose_in_base, 'laser pose')
        rays = usable_rays(scan, laser_pose_in_base, self.params)
        self._check_time(scan.stamp_ns)
        if self._odom_pose is None:
            return self._begin(odom_pose, scan.stamp_ns, rays)
        if not self._is_due(odom_pose, scan.stamp_ns):
            return None
        return self._step(odom_pose, scan.stamp_ns, rays)

    def _check_time(self, stamp_ns: int) -> None:
        if self._newest_ns is not None and stamp_ns < self._newest_ns:
            raise InputFault(
                f'scan: given a stamp of {stamp_ns / NANOSECONDS_PER_SECOND:.3f} s after one of '
                f'{self._newest_ns / NANOSECONDS_PER_SECOND:.3f} s: time went back; '
                'the map so far is kept'
            )
        self._newest_ns = stamp_ns

    def _is_due(self, odom_pose: Pose2D, stamp_ns: int) -> bool:
        params, move = self.params, odom_pose.relative_to(self._odom_pose)
        waited_s = (stamp_ns - self._estimate.stamp_ns) / NANOSECONDS_PER_SECOND
        return (
            math.hypot(move.x_m, move.y_m) >= params.linearUpdate
            or abs(move.yaw_rad) >= params.angularUpdate
            or 0.0 <= params.temporalUpdate < waited_s
        )

    def _begin(self, odom_pose: Pose2D, stamp_ns: int, rays: Rays) -> SlamEstimate:
        start_pose = odom_pose if self._start_pose is None else self._start_pose
        self._particles = np.tile(np.array(start_pose), (self.params.particles, 1))
        self._enter(rays)
        # Equal maps: one does for all.
        self.maps.redraw(np.zeros(self.params.particles, int))
        return self._finish(odom_pose, stamp_ns, np.zeros(self.params.particles), False)

    def _step(self, odom_pose: Pose2D, stamp_ns: int, rays: Rays) -> SlamEstimate:
        """Algorithm 1, with its line numbers."""
        move = odom_pose.relative_to(self._odom_pose)
        self._cover(apply_moves(self._particles, np.array(move)), rays)
        proposed = propose(self.maps, self._particles, move, rays, self.params, self._rng)  # 4 to 23
        self._particles = proposed.particles
        self._log_weights = self._log_weights + proposed.log_factors  # 24
        self._log_path_weights = self._log_path_weights + proposed.log_factors
        self._enter(rays)  # 26
        return self._finish(odom_pose, stamp_ns, proposed.scores, True)

    def _finish(self, odom_pose: Pose2D, stamp_ns: int, scores: np.ndarray, may_resample: bool) -> SlamEstimate:
        """Note the step, and redraw the particles when few of them count (lines 29 to 32)."""
        self._odom_pose = odom_pose
        self._history.add(stamp_ns, self._particles, self._parents)
        weights, best = self.weights, self._best()
        count = effective_count(weights)
        is_due = may_resample and count < self.params.resampleThreshold * len(weights)
        base_pose = Pose2D(*self._particles[best].tolist())
        self._estimate = SlamEstimate(
            stamp_ns,
            base_pose,
            base_pose.compose(odom_pose.inverse()),
            entropy_of(weights),
            count,
            is_due,
            float(scores[best]),
        )
        self._parents = np.arange(len(weights))
        if is_due:
            self._redraw(systematic_indices(weights, self._rng))
        return self._estimate

    def _redraw(self, indices: np.ndarray) -> None:
        self._particles = self._particles[indices]
        self._log_weights = np.zeros(len(indices))
        self._log_path_weights = self._log_path_weights[indices]
        self._parents = indices
        self.maps.redraw(indices)

    def _enter(self, rays: Rays) -> None:
        self._cover(self._particles, rays)
        update_maps(self.maps, self._particles, rays)

    def _cover(self, particles: np.ndarray, rays: Rays) -> None:
        reach_m = rays.reach_m() + MATCH_MARGIN_M
        lowest, highest = particles[:, :2].min(axis=0), particles[:, :2].max(axis=0)
        self.maps.cover(Extent(*(lowest - reach_m).tolist(), *(highest + reach_m).tolist()))

    def _best(self) -> int:
        """The particle with the likeliest path."""
        return int(np.argmax(self._log_path_weights))
