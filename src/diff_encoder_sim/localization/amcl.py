"""Adaptive Monte Carlo localization, as upstream's amcl runs it, without ROS and without a clock.

Thrun, Burgard and Fox, Probabilistic Robotics, table 8.3 (augmented MCL) with Fox's KLD-sampling
("Adapting the sample size in particle filters through KLD-sampling", IJRR 2003).
"""

from __future__ import annotations

import math
from typing import NamedTuple, Optional

import numpy as np

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.beams import Beams
from diff_encoder_sim.localization.clusters import particle_statistics
from diff_encoder_sim.localization.kld_resampling import LikelihoodAverages, effective_count, kld_limits, resample
from diff_encoder_sim.localization.laser_models import laser_model
from diff_encoder_sim.localization.lost import LostDetector
from diff_encoder_sim.localization.odometry_motion import motion_model
from diff_encoder_sim.localization.particles import (
    CONVERGED_WITHIN_M,
    check_covariance,
    check_grid,
    check_pose,
    free_cell_centres,
    has_converged,
    particles_around,
    particles_everywhere,
    weight_near,
)
from diff_encoder_sim.localization.sensor import Likelihoods
from diff_encoder_sim.mapping.occupancy_grid import OccupancyGrid

# Of a number that still fits a double.
LARGEST_EXPONENT = 700.0

# Particles have settled when all but a few, which recovery may have drawn anywhere, lie as close
# together as converged ones.
SETTLED_WEIGHT = 0.9


class AmclEstimate(NamedTuple):
    """Where the robot was when a scan was taken, in the map frame."""

    stamp_ns: int  # the scan's
    base_pose_in_map: Pose2D  # mean of the heaviest cluster
    covariance: np.ndarray  # 3x3 over (x [m], y [m], yaw [rad]), of all particles
    odom_pose_in_map: Pose2D  # the transform map->odom that makes base_pose_in_map true
    cluster_weight: float  # share of the particles' weight in that cluster, 0 to 1
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
            InputFault: the map is empty, has no free cell, or a resolution or origin that is none.
        """
        self.params = params
        self._rng = rng
        self._motion_model = motion_model(params)
        self._averages = LikelihoodAverages(params.recovery_alpha_slow, params.recovery_alpha_fast)
        self._limits = kld_limits(params)
        self._estimate: Optional[AmclEstimate] = None
        self.update_count = 0  # filter updates so far; /particlecloud is due after each
        self.set_map(grid)
        self._force_update = False

    # What it can be told.

    def set_map(
        self, grid: OccupancyGrid, pose: Optional[Pose2D] = None, covariance: Optional[np.ndarray] = None
    ) -> None:
        """Begin again on another map, at `pose` (default: the parameters' initial pose).

        Args:
            grid: 0 is free, 100 is occupied, anything else unknown.
            pose: base in the map.
            covariance: 3x3 over (x [m], y [m], yaw [rad]).

        Raises:
            InputFault: the map, pose or covariance is bad. The old map and particles stay.
        """
        check_grid(grid)
        params = self.params
        if pose is None:
            pose = Pose2D(params.initial_pose_x, params.initial_pose_y, params.initial_pose_a)
        if covariance is None:
            covariance = np.diag([params.initial_cov_xx, params.initial_cov_yy, params.initial_cov_aa])
        check_pose(pose, 'initial pose')
        check_covariance(covariance)
        self.grid = grid
        self._free_centres = free_cell_centres(grid)
        self._laser_model = laser_model(params, grid)
        self._lost = LostDetector(params, grid)
        self._estimate = None
        self._begin(particles_around(pose, covariance, params.max_particles, self._rng))
        self._force_update = params.force_update_after_set_map

    def set_pose(self, pose: Pose2D, covariance: np.ndarray) -> None:
        """Begin again around a pose in the map, as by /initialpose.

        Args:
            pose: base in the map.
            covariance: 3x3 over (x [m], y [m], yaw [rad]); upstream's reads x, y and yaw alone.

        Raises:
            InputFault: not finite, or not a covariance. The particles stay.
        """
        check_pose(pose, 'initial pose')
        check_covariance(covariance)
        self._begin(particles_around(pose, covariance, self.params.max_particles, self._rng))
        self._force_update |= self.params.force_update_after_initialpose

    def global_localization(self) -> None:
        """Begin again with the robot anywhere on the map's free cells, heading anywhere."""
        self._begin(particles_everywhere(self._free_centres, self.params.max_particles, self._rng))
        self._is_anywhere = True
        self._lost.declare_lost()

    def request_nomotion_update(self) -> None:
        """Let the next scan update the filter though the robot has not moved."""
        self._force_update = True

    # What it tells.

    @property
    def particles(self) -> np.ndarray:
        """(n, 3) x [m], y [m], yaw [rad] in the map."""
        return self._particles

    @property
    def weights(self) -> np.ndarray:
        """(n,) weights of the particles, sum 1."""
        return self._weights

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
        """Whether scans contradict the filter: then nobody should drive by `odom_pose_in_map`."""
        return self._lost.is_lost

    @property
    def fit_fraction(self) -> Optional[float]:
        """Share of the newest scan's rays that fit the map, 0 to 1; None before there is one."""
        return self._lost.fit_fraction

    # The filter.

    def update(self, odom_pose: Pose2D, scan: Scan, laser_pose_in_base: Pose2D) -> Optional[AmclEstimate]:
        """Take one scan; an estimate when one is due, else None.

        The filter updates on the first scan after it began, and whenever the robot has moved by
        update_min_d along x or y or turned by update_min_a, or an update was requested. Estimates
        come on the first update and on those that resample, each resample_interval-th. Every scan
        tells whether the robot is lost.

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
            self._lost.check(
                self._estimate.odom_pose_in_map.compose(odom_pose),
                scan,
                laser_pose_in_base,
                may_be_found=self._has_settled or not self._is_anywhere,
            )
        return estimate

    def _update_filter(self, odom_pose: Pose2D, beams: Beams, stamp_ns: int) -> Optional[AmclEstimate]:
        is_first = self._odom_pose is None
        if not (
            is_first
            or self._force_update
            or self._is_settling_on_the_spot()
            or self._has_moved(odom_pose, self._odom_pose)
        ):
            return None
        if not is_first:
            # A request made before the first scan, which updates anyway, waits for the second.
            self._force_update = False
            self._particles = self._motion_model(self._particles, self._odom_pose, odom_pose, self._rng)
        self._odom_pose = odom_pose
        self._weigh(self._laser_model.likelihoods(self._particles, beams, self._has_converged))
        self.update_count += 1
        self._updates_since_begin += 1
        is_resampling_due = self._updates_since_begin % self.params.resample_interval == 0
        if is_resampling_due:
            self._resample()
        if not (is_resampling_due or is_first):
            return None
        self._estimate = self._new_estimate(stamp_ns, odom_pose)
        return self._estimate

    def _begin(self, particles: np.ndarray) -> None:
        """Take particles of equal weight; the next scan is the first."""
        self._particles = particles
        self._weights = np.full(len(particles), 1.0 / len(particles))
        self._is_anywhere = self._has_settled = False
        self._take_statistics()
        self._has_converged = False
        self._averages.reset()
        self._odom_pose: Optional[Pose2D] = None
        self._updates_since_begin = 0
        self._lost.start_counting_again()

    def _is_settling_on_the_spot(self) -> bool:
        """A lost robot should not move, so scans from where it stands must do.

        Only to settle around a pose that somebody gave: over a whole map, or after a kidnapping,
        particles would settle at a wrong place that looks alike.
        """
        return self.is_lost and not (self._has_settled or self._is_anywhere)

    def _has_moved(self, odom_pose: Pose2D, last: Pose2D) -> bool:
        """Whether far enough since the last update; along x or y, not as the crow flies."""
        params = self.params
        return (
            abs(odom_pose.x_m - last.x_m) > params.update_min_d
            or abs(odom_pose.y_m - last.y_m) > params.update_min_d
            or abs(wrap_angle(odom_pose.yaw_rad - last.yaw_rad)) > params.update_min_a
        )

    def _weigh(self, likelihoods: Likelihoods) -> None:
        """Multiply the weights by the scan's likelihoods (table 8.3, lines 5 to 13)."""
        weights = self._weights * likelihoods.factors
        total = float(weights.sum())
        if total > 0.0:
            self._weights = weights / total
            # The weights summed to 1, so the total is the mean likelihood. Upstream divides it by
            # n once more: an n that KLD-sampling has made smaller then looks like a better fit,
            # and a robot that is carried off is not missed.
            self._averages.add(total * math.exp(min(likelihoods.log_scale, LARGEST_EXPONENT)))
        else:
            self._weights = np.full(len(weights), 1.0 / len(weights))

    def _resample(self) -> None:
        """Draw new particles (table 8.3, lines 14 to 19), if selective_resampling finds it due."""
        if not self._is_weight_spread():
            fraction_anywhere = self._averages.fraction_anywhere()
            self._particles = resample(
                self._particles, self._weights, self._limits, fraction_anywhere, self._free_centres, self._rng
            )
            self._weights = np.full(len(self._particles), 1.0 / len(self._particles))
            self._has_converged = has_converged(self._particles)
            if fraction_anywhere > 0.0:
                # Upstream: or the filter would spiral off into complete randomness.
                self._averages.reset()
        self._take_statistics()

    def _take_statistics(self) -> None:
        self._statistics = particle_statistics(self._particles, self._weights)
        # Once and for all: the noise of a long move spreads particles, but not to other places.
        self._has_settled = self._has_settled or SETTLED_WEIGHT <= weight_near(
            self._particles, self._weights, self._statistics.mean, CONVERGED_WITHIN_M
        )

    def _is_weight_spread(self) -> bool:
        """Whether selective_resampling is on and over half of the particles still count."""
        return self.params.selective_resampling and effective_count(self._weights) > 0.5 * len(self._weights)

    def _new_estimate(self, stamp_ns: int, odom_pose: Pose2D) -> AmclEstimate:
        statistics = self._statistics
        return AmclEstimate(
            stamp_ns,
            statistics.mean,
            statistics.covariance,
            statistics.mean.compose(odom_pose.inverse()),
            statistics.cluster_weight,
            statistics.cluster_count,
            self._particles,
            self._weights,
        )
