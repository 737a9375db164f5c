"""Adaptive Monte Carlo localization, as upstream's amcl runs it, without ROS and without a clock.

Thrun, Burgard and Fox, Probabilistic Robotics, table 8.3 (augmented MCL) with Fox's KLD-sampling
("Adapting the sample size in particle filters through KLD-sampling", IJRR 2003).
"""

from __future__ import annotations

import math
from typing import NamedTuple, Optional

import numpy as np

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, wrap_angle
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.beams import Beams
from diff_encoder_sim.localization.laser_models import laser_model
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, FreeCells, OccupancyGrid
from diff_encoder_sim.localization.particles import (
    ParticleSet,
    check_covariance,
    check_grid,
    check_pose,
    particles_around,
    particles_everywhere,
)
from diff_encoder_sim.localization.scan_fit import FitMap, LostDetector


class AmclEstimate(NamedTuple):
    """The robot's estimated pose when a scan was taken, in the map frame."""

    stamp_ns: int  # the scan's
    base_pose_in_map: Pose2D  # mean of the heaviest cluster
    covariance: np.ndarray  # 3x3 over (x [m], y [m], yaw [rad]), of all particles
    odom_pose_in_map: Pose2D  # the transform map->odom that corresponds to base_pose_in_map
    cluster_weight: float  # fraction of the particles' weight in that cluster, 0 to 1
    cluster_count: int
    particles: np.ndarray  # (n, 3) x [m], y [m], yaw [rad] in the map; do not change
    weights: np.ndarray  # (n,), sum 1; do not change


class Amcl:
    """The particle filter: feed it every scan with the odometry's pose at the scan's time.

    Every random draw comes from `rng`: equal seeds and inputs give equal results, bit for bit.
    Arrays that it hands out are never changed afterwards.
    """

    def __init__(self, params: AmclParams, grid: OccupancyGrid, rng: np.random.Generator) -> None:
        """Start from the parameters' initial pose and covariance on `grid`.

        Raises:
            InputFault: the map is empty, has no free cell, or an invalid resolution or origin.
        """
        self.params = params
        self._rng = rng
        self.update_count = 0  # filter updates so far; /particlecloud is due after each
        self._estimate: Optional[AmclEstimate] = None
        self._odom_pose: Optional[Pose2D] = None  # at the last update; None since a restart
        check_grid(grid)
        particles = self._particles_around(params.initial_pose(), params.initial_covariance())
        self._set = ParticleSet(params, particles, rng)
        self._use_map(grid)
        self._is_anywhere = False  # no pose was given since the restart
        self._updates_since_restart = 0
        self._force_update = False

    # Commands

    def set_map(
        self, grid: OccupancyGrid, pose: Optional[Pose2D] = None, covariance: Optional[np.ndarray] = None
    ) -> None:
        """Restart on another map, around `pose` (default: the parameters' initial pose).

        Args:
            grid: 0 is free, 100 is occupied, anything else unknown.
            pose: base in the map.
            covariance: 3x3 over (x [m], y [m], yaw [rad]).

        Raises:
            InputFault: the map, pose or covariance is bad. The old map and particles stay.
        """
        check_grid(grid)
        particles = self._particles_around(
            self.params.initial_pose() if pose is None else pose,
            self.params.initial_covariance() if covariance is None else covariance,
        )
        self._use_map(grid)
        self._restart(particles)
        self._force_update = self.params.force_update_after_set_map

    def set_pose(self, pose: Pose2D, covariance: np.ndarray) -> None:
        """Restart around a pose in the map, as /initialpose asks.

        Args:
            pose: base in the map.
            covariance: 3x3 over (x [m], y [m], yaw [rad]); as upstream, x, y and yaw-yaw entries count.

        Raises:
            InputFault: not finite, or not a covariance. The particles stay.
        """
        self._restart(self._particles_around(pose, covariance))
        self._force_update |= self.params.force_update_after_initialpose

    def global_localization(self) -> None:
        """Restart with the robot anywhere on the map's free cells, heading anywhere."""
        self._restart(particles_everywhere(self._free_cells, self.params.max_particles, self._rng))
        self._is_anywhere = True
        self._lost.declare_lost()

    def request_nomotion_update(self) -> None:
        """Let the next scan update the filter though the robot has not moved."""
        self._force_update = True

    def reconfigure(self, params: AmclParams) -> None:
        """Use other parameters from the next scan on; particles and estimate stay (upstream draws new particles)."""
        self.params = params
        self._set.reconfigure(params)
        self._laser_model = laser_model(params, self.grid)

    # State

    @property
    def particles(self) -> np.ndarray:
        """(n, 3) x [m], y [m], yaw [rad] in the map."""
        return self._set.particles

    @property
    def weights(self) -> np.ndarray:
        """(n,) weights of the particles, sum 1."""
        return self._set.weights

    @property
    def last_estimate(self) -> Optional[AmclEstimate]:
        """The newest estimate on this map, None before the first."""
        return self._estimate

    @property
    def odom_pose_in_map(self) -> Optional[Pose2D]:
        """The transform map->odom to broadcast after every scan, None before the first estimate."""
        return self._estimate.odom_pose_in_map if self._estimate else None

    @property
    def is_lost(self) -> bool:
        """True while scans contradict the estimated pose: then nobody should drive by it."""
        return self._lost.is_lost

    @property
    def fit_fraction(self) -> Optional[float]:
        """Fraction of the newest scan's rays that agree with the map, 0 to 1; None before one."""
        return self._lost.fit_fraction

    # The filter

    def update(self, odom_pose: Pose2D, scan: Scan, laser_pose_in_base: Pose2D) -> Optional[AmclEstimate]:
        """Take one scan; return an estimate when one is due, else None.

        The filter updates on the first scan after a restart, whenever the robot has moved by
        update_min_d along x or y or turned by update_min_a, and on request. Estimates come on the
        first update and on those that resample, each resample_interval-th. Every scan is checked
        for whether the robot is lost.

        Args:
            odom_pose: base in odom at the scan's stamp.
            scan: ranges that are NaN, infinite or out of range are allowed, if not all are.
            laser_pose_in_base: where the laser is mounted, upside-down excluded.

        Raises:
            InputFault: the scan, pose or mount cannot be used. The filter is as before.
        """
        check_pose(odom_pose, 'odometry pose')
        check_pose(laser_pose_in_base, 'laser pose')
        beams = self._laser_model.beams(scan, laser_pose_in_base)
        estimate = self._update_filter(odom_pose, beams, scan.stamp_ns)
        if self._estimate is not None:
            base_pose = self._estimate.odom_pose_in_map.compose(odom_pose)
            may_be_found = self._set.has_settled or not self._is_anywhere
            self._lost.check(base_pose, scan, laser_pose_in_base, may_be_found)
        return estimate

    def _update_filter(self, odom_pose: Pose2D, beams: Beams, stamp_ns: int) -> Optional[AmclEstimate]:
        if not self._is_update_due(odom_pose):
            return None
        last, self._odom_pose = self._odom_pose, odom_pose
        if last is not None:
            # A request made before the first scan, which updates anyway, waits for the second.
            self._force_update = False
            self._set.move(last, odom_pose)
        self._set.weigh(self._laser_model.likelihoods(self._set.particles, beams, self._set.has_converged))
        self.update_count += 1
        self._updates_since_restart += 1
        is_resampling_due = self._updates_since_restart % self.params.resample_interval == 0
        if is_resampling_due:
            self._set.resample(self._free_cells)
        if is_resampling_due or last is None:
            self._estimate = self._new_estimate(stamp_ns, odom_pose)
            return self._estimate
        return None

    def _particles_around(self, pose: Pose2D, covariance: np.ndarray) -> np.ndarray:
        """Draw the most particles from a Gaussian, or raise InputFault where it is none."""
        check_pose(pose, 'initial pose')
        check_covariance(covariance)
        return particles_around(pose, covariance, self.params.max_particles, self._rng)

    def _use_map(self, grid: OccupancyGrid) -> None:
        self.grid = grid
        self._free_cells = FreeCells(grid)
        self._laser_model = laser_model(self.params, grid)
        self._lost = LostDetector(self.params, grid)
        self._estimate = None

    def _restart(self, particles: np.ndarray) -> None:
        """Take particles of equal weight; the next scan is the first."""
        self._set.restart(particles)
        self._is_anywhere = False
        self._odom_pose = None
        self._updates_since_restart = 0
        self._lost.restart_count()

    def _is_update_due(self, odom_pose: Pose2D) -> bool:
        last = self._odom_pose
        return last is None or self._force_update or self._is_settling_on_the_spot() or self._has_moved(last, odom_pose)

    def _is_settling_on_the_spot(self) -> bool:
        """Return whether a lost robot, which should stand still, is to update from where it is.

        Only to settle around a pose that somebody gave: over a whole map, or after a kidnapping,
        particles would settle at a wrong place that looks alike.
        """
        return self.is_lost and not (self._set.has_settled or self._is_anywhere)

    def _has_moved(self, last: Pose2D, odom_pose: Pose2D) -> bool:
        """Compare the motion since the last update with update_min_*: along x or y, not as a distance."""
        params = self.params
        return (
            abs(odom_pose.x_m - last.x_m) > params.update_min_d
            or abs(odom_pose.y_m - last.y_m) > params.update_min_d
            or abs(wrap_angle(odom_pose.yaw_rad - last.yaw_rad)) > params.update_min_a
        )

    def _new_estimate(self, stamp_ns: int, odom_pose: Pose2D) -> AmclEstimate:
        statistics = self._set.statistics
        return AmclEstimate(
            stamp_ns,
            statistics.mean,
            statistics.covariance,
            statistics.mean.compose(odom_pose.inverse()),
            statistics.cluster_weight,
            statistics.cluster_count,
            self._set.particles,
            self._set.weights,
        )


CELLS, RESOLUTION_M, RAYS, PARTICLES = 60, 0.1, 20, 20


def warm_up(params: AmclParams) -> None:
    """Run each kernel that a filter with these parameters, and the check of its scans, need once, in a small room.

    Takes milliseconds where numba's cache is filled, some seconds where it is not.
    """
    counts = {'min_particles': PARTICLES, 'max_particles': PARTICLES}
    few = params.model_copy(update={**counts, 'resample_interval': 1, 'selective_resampling': False})
    grid = _room()
    scan = Scan(0, -math.pi, 2.0 * math.pi / RAYS, 0.1, 10.0, np.full(RAYS, 2.9))
    amcl = Amcl(few, grid, np.random.default_rng(0))
    amcl.update(IDENTITY, scan, IDENTITY)
    FitMap(grid, RESOLUTION_M).fit(IDENTITY, scan, IDENTITY)
    # Beam skipping waits for particles that have converged.
    model = laser_model(few, grid)
    model.likelihoods(amcl.particles, model.beams(scan, IDENTITY), True)


def _room() -> OccupancyGrid:
    """Return an empty room of 6 x 6 m about the map's origin."""
    cells = np.full((CELLS, CELLS), OCCUPIED, np.int8)
    cells[1:-1, 1:-1] = FREE
    corner_m = -0.5 * CELLS * RESOLUTION_M
    return OccupancyGrid(cells, RESOLUTION_M, Pose2D(corner_m, corner_m, 0.0))
