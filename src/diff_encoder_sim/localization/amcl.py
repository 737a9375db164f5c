"""Adaptive Monte Carlo localization as in upstream's amcl, without ROS and without a clock.

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
from diff_encoder_sim.localization.occupancy_grid import FreeCells, OccupancyGrid, square_room
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
    """The particle filter; pass every scan with the odometry pose at its stamp.

    Every random draw comes from `rng`: equal seeds and inputs give equal results, bit for bit.
    Returned arrays are never modified.
    """

    def __init__(self, params: AmclParams, grid: OccupancyGrid, rng: np.random.Generator) -> None:
        """Start from the parameters' initial pose and covariance; raise InputFault for an unusable map."""
        self.params = params
        self._rng = rng
        self.update_count = 0  # filter updates so far; /particlecloud is due after each
        self.last_estimate: Optional[AmclEstimate] = None  # on this map
        self._odom_pose: Optional[Pose2D] = None  # at the last update; None since a restart
        check_grid(grid)
        particles = self._particles_around(params.initial_pose(), params.initial_covariance())
        self._set = ParticleSet(params, particles, rng)
        self._use_map(grid)
        self._is_anywhere = False  # without a given pose since the restart
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
            InputFault: the map, pose or covariance is bad. The old map and particles are kept.
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
        """Restart around a pose in the map, as for /initialpose.

        Args:
            pose: base in the map.
            covariance: 3x3 over (x [m], y [m], yaw [rad]); as upstream, only x, y and yaw-yaw entries are used.

        Raises:
            InputFault: not finite, or not a covariance. The particles are kept.
        """
        self._restart(self._particles_around(pose, covariance))
        self._force_update |= self.params.force_update_after_initialpose

    def global_localization(self) -> None:
        """Restart with a uniform distribution over the free cells and all headings."""
        self._restart(particles_everywhere(self._free_cells, self.params.max_particles, self._rng))
        self._is_anywhere = True
        self._lost.declare_lost()

    def request_nomotion_update(self) -> None:
        """Update the filter with the next scan even without motion."""
        self._force_update = True

    def reconfigure(self, params: AmclParams) -> None:
        """Set the parameters for the next scan; particles and estimate are kept (upstream samples new particles)."""
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
    def odom_pose_in_map(self) -> Optional[Pose2D]:
        """The transform map->odom to broadcast after every scan, None before the first estimate."""
        return self.last_estimate.odom_pose_in_map if self.last_estimate else None

    @property
    def is_lost(self) -> bool:
        """True while scans contradict the estimated pose; do not drive with it."""
        return self._lost.is_lost

    @property
    def fit_fraction(self) -> Optional[float]:
        """Fraction of the newest scan's rays that agree with the map, 0 to 1; None before one."""
        return self._lost.fit_fraction

    # The filter

    def update(self, odom_pose: Pose2D, scan: Scan, laser_pose_in_base: Pose2D) -> Optional[AmclEstimate]:
        """Process a scan; return an estimate when one is due, else None.

        The filter updates on the first scan after a restart, whenever the robot has moved by
        update_min_d along x or y or turned by update_min_a, and on request. Estimates are returned on the
        first update and on each resample_interval-th, which resamples. Every scan is used to check
        whether the robot is lost.

        Args:
            odom_pose: base in odom at the scan's stamp.
            scan: ranges that are NaN, infinite or out of range are allowed, if not all are.
            laser_pose_in_base: mounting pose of the laser, not upside-down.

        Raises:
            InputFault: the scan, pose or mount cannot be used. The filter is unchanged.
        """
        check_pose(odom_pose, 'odometry pose')
        check_pose(laser_pose_in_base, 'laser pose')
        beams = self._laser_model.beams(scan, laser_pose_in_base)
        estimate = self._update_filter(odom_pose, beams, scan.stamp_ns)
        if self.last_estimate is not None:
            base_pose = self.last_estimate.odom_pose_in_map.compose(odom_pose)
            may_be_found = self._set.has_settled or not self._is_anywhere
            self._lost.check(base_pose, scan, laser_pose_in_base, may_be_found)
        return estimate

    def _update_filter(self, odom_pose: Pose2D, beams: Beams, stamp_ns: int) -> Optional[AmclEstimate]:
        if not self._is_update_due(odom_pose):
            return None
        particles, last, self._odom_pose = self._set, self._odom_pose, odom_pose
        if last is not None:
            # The first scan updates anyway; a request before it applies to the second.
            self._force_update = False
            particles.move(last, odom_pose)
        particles.weigh(self._laser_model.likelihoods(particles.particles, beams, particles.has_converged))
        self.update_count += 1
        self._updates_since_restart += 1
        is_resampling_due = self._updates_since_restart % self.params.resample_interval == 0
        if is_resampling_due:
            particles.resample(self._free_cells)
        if not is_resampling_due and last is not None:
            return None
        mean, covariance, cluster_weight, cluster_count = particles.statistics
        odom_pose_in_map = mean.compose(odom_pose.inverse())
        self.last_estimate = AmclEstimate(
            stamp_ns,
            mean,
            covariance,
            odom_pose_in_map,
            cluster_weight,
            cluster_count,
            particles.particles,
            particles.weights,
        )
        return self.last_estimate

    def _particles_around(self, pose: Pose2D, covariance: np.ndarray) -> np.ndarray:
        """Sample max_particles from a Gaussian; raise InputFault for an invalid covariance."""
        check_pose(pose, 'initial pose')
        check_covariance(covariance)
        return particles_around(pose, covariance, self.params.max_particles, self._rng)

    def _use_map(self, grid: OccupancyGrid) -> None:
        self.grid = grid
        self._free_cells = FreeCells(grid)
        self._laser_model = laser_model(self.params, grid)
        self._lost = LostDetector(self.params, grid)
        self.last_estimate = None

    def _restart(self, particles: np.ndarray) -> None:
        """Set particles of equal weight; the next scan is the first."""
        self._set.restart(particles)
        self._is_anywhere = False
        self._odom_pose = None
        self._updates_since_restart = 0
        self._lost.restart_count()

    def _is_update_due(self, odom_pose: Pose2D) -> bool:
        """Return whether there was no update yet, one is requested, or the robot has moved by update_min_*.

        Along x or y, not as a distance. A lost robot, which should stand still, converges without motion, but only
        around a given pose: over a whole map, or after a kidnapping, particles would converge to a similar wrong place.
        """
        last, params = self._odom_pose, self.params
        if last is None or self._force_update or (self.is_lost and not (self._set.has_settled or self._is_anywhere)):
            return True
        return (
            abs(odom_pose.x_m - last.x_m) > params.update_min_d
            or abs(odom_pose.y_m - last.y_m) > params.update_min_d
            or abs(wrap_angle(odom_pose.yaw_rad - last.yaw_rad)) > params.update_min_a
        )


RAYS, PARTICLES = 20, 20


def warm_up(params: AmclParams) -> None:
    """Run each kernel of a filter with these parameters and of its scan check once, in a small room.

    Takes milliseconds with numba's cache, else some seconds.
    """
    counts = {'min_particles': PARTICLES, 'max_particles': PARTICLES}
    few = params.model_copy(update={**counts, 'resample_interval': 1, 'selective_resampling': False})
    grid = square_room()
    scan = Scan(0, -math.pi, 2.0 * math.pi / RAYS, 0.1, 10.0, np.full(RAYS, 2.9))
    amcl = Amcl(few, grid, np.random.default_rng(0))
    amcl.update(IDENTITY, scan, IDENTITY)
    FitMap(grid, grid.resolution_m).fit(IDENTITY, scan, IDENTITY)
    # Beam skipping starts when particles have converged.
    model = laser_model(few, grid)
    model.likelihoods(amcl.particles, model.beams(scan, IDENTITY), True)
