"""Adaptive Monte Carlo localization as in upstream's amcl, without ROS and without a clock.

Thrun, Burgard and Fox, Probabilistic Robotics, table 8.3 (augmented MCL) with Fox's KLD-sampling
("Adapting the sample size in particle filters through KLD-sampling", IJRR 2003).
"""

from __future__ import annotations

import math
from typing import NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, wrap_angle
from diff_encoder_sim.localization import particles as particle_sets
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.laser_models import Beams, Likelihoods, laser_model
from diff_encoder_sim.localization.occupancy_grid import FreeCells, OccupancyGrid, square_room
from diff_encoder_sim.localization.scan_fit import FitMap, LostDetector

CONVERGED_WITHIN_M = 0.5  # of all particles, from their mean along x or y: upstream's pf_alloc
SETTLED_WEIGHT = 0.9  # fraction of the weight as close together; recovery may have drawn the rest anywhere
LARGEST_EXPONENT = 700.0  # the exponential of a larger number overflows a double


class AmclEstimate(NamedTuple):
    """The robot's estimated pose when a scan was taken, in the map frame."""

    stamp_ns: int  # the scan's
    base_pose_in_map: Pose2D  # mean of the heaviest cluster
    covariance: np.ndarray  # 3x3 over (x [m], y [m], yaw [rad]), of all particles
    odom_pose_in_map: Pose2D  # the transform map->odom that corresponds to base_pose_in_map


class Amcl:
    """The particle filter; pass every scan with the odometry pose at its stamp.

    All samples come from `rng`: equal seeds and inputs give equal results, bit for bit.
    """

    particles: np.ndarray  # (n, 3) x [m], y [m], yaw [rad] in the map; arrays are replaced, never changed
    weights: np.ndarray  # (n,) of the particles, sum 1; likewise
    statistics: Tuple[Pose2D, np.ndarray]  # mean and covariance at the last restart or resampling
    has_converged: bool  # all particles were close together at the last resampling: upstream's
    has_settled: bool  # most of the weight has been close together since the restart
    slow_average: float  # of the scans' likelihoods (table 8.3, lines 10 and 11); 0 for none
    last_estimate: Optional[AmclEstimate]  # on this map
    _odom_pose: Optional[Pose2D]  # at the last update; None since a restart

    def __init__(self, params: AmclParams, grid: OccupancyGrid, rng: np.random.Generator) -> None:
        """Start from the parameters' initial pose and covariance; raise InputFault for an unusable map."""
        self.params, self._rng = params, rng
        self.update_count = 0  # filter updates so far; /particlecloud is due after each
        self.set_map(grid)
        self._force_update = False

    def set_map(
        self, grid: OccupancyGrid, pose: Optional[Pose2D] = None, covariance: Optional[np.ndarray] = None
    ) -> None:
        """Restart on another map, around `pose` (base in the map; default: the parameters' initial pose).

        `covariance` is 3x3 over (x, y, yaw). Raises InputFault, without effect, for a bad map, pose or covariance.
        """
        particle_sets.check_grid(grid)
        params = self.params
        pose = params.initial_pose() if pose is None else pose
        if covariance is None:
            covariance = np.diag([params.initial_cov_xx, params.initial_cov_yy, params.initial_cov_aa])
        particles = particle_sets.particles_around(pose, covariance, params.max_particles, self._rng)
        self.grid, self.last_estimate = grid, None
        self._free_cells, self._lost = FreeCells(grid), LostDetector(params, grid)
        self.reconfigure(params)
        self._restart(particles)
        self._force_update = params.force_update_after_set_map

    def set_pose(self, pose: Pose2D, covariance: np.ndarray) -> None:
        """Restart around a pose (base in the map), as `particles_around`; InputFault has no effect."""
        self._restart(particle_sets.particles_around(pose, covariance, self.params.max_particles, self._rng))
        self._force_update |= self.params.force_update_after_initialpose

    def global_localization(self) -> None:
        """Restart with a uniform distribution over the free cells and all headings."""
        cells, count = self._free_cells, self.params.max_particles
        places_m = cells.centres(self._rng.integers(0, len(cells), count))
        self._restart(np.column_stack([places_m, self._rng.uniform(-np.pi, np.pi, count)]))
        self._is_anywhere = True
        self._lost.declare_lost()

    def request_nomotion_update(self) -> None:
        """Update the filter with the next scan even without motion."""
        self._force_update = True

    def reconfigure(self, params: AmclParams) -> None:
        """Set the parameters for the next scan; particles and estimate are kept (upstream samples new particles)."""
        self.params = params
        self._limits = particle_sets.kld_limits(params)
        self.slow_average = self.fast_average = 0.0
        self._laser_model = laser_model(params, self.grid)

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

    @property
    def fraction_anywhere(self) -> float:
        """Fraction of particles to sample anywhere on the map, 0 to 1 (table 8.3, line 13)."""
        return max(0.0, 1.0 - self.fast_average / self.slow_average) if self.slow_average else 0.0

    def update(self, odom_pose: Pose2D, scan: Scan, laser_pose_in_base: Pose2D) -> Optional[AmclEstimate]:
        """Process a scan; return an estimate on the first update and on each resample_interval-th, else None.

        The filter updates on the first scan after a restart, after motion (update_min_d, update_min_a) and on request;
        every scan is used to check whether the robot is lost. `odom_pose` is the base in odom at the scan's stamp.
        Raises InputFault, without effect, if the scan, pose or mount cannot be used; the laser may not be upside-down.
        """
        particle_sets.check_pose(odom_pose, 'odometry pose')
        particle_sets.check_pose(laser_pose_in_base, 'laser pose')
        beams = self._laser_model.beams(scan, laser_pose_in_base)
        estimate = self._update_filter(odom_pose, beams, scan.stamp_ns) if self._is_update_due(odom_pose) else None
        if self.last_estimate is not None:
            base_pose = self.last_estimate.odom_pose_in_map.compose(odom_pose)
            self._lost.check(base_pose, scan, laser_pose_in_base, self.has_settled or not self._is_anywhere)
        return estimate

    def _update_filter(self, odom_pose: Pose2D, beams: Beams, stamp_ns: int) -> Optional[AmclEstimate]:
        """Move, weigh and resample the particles (lines 5 to 19)."""
        last, self._odom_pose = self._odom_pose, odom_pose
        if last is not None:
            # The first scan updates anyway; a request before it applies to the second.
            self._force_update = False
            self.particles = particle_sets.move_particles(self.particles, last, odom_pose, self.params, self._rng)
        self._weigh(self._laser_model.likelihoods(self.particles, beams, self.has_converged))
        self.update_count += 1
        self._updates_since_restart += 1
        is_resampling_due = self._updates_since_restart % self.params.resample_interval == 0
        if is_resampling_due:
            self._resample()
        elif last is not None:
            return None
        mean, covariance = self.statistics
        self.last_estimate = AmclEstimate(stamp_ns, mean, covariance, mean.compose(odom_pose.inverse()))
        return self.last_estimate

    def _weigh(self, likelihoods: Likelihoods) -> None:
        """Multiply the weights by a scan's likelihoods (lines 6 to 11)."""
        weights, params = self.weights * likelihoods.factors, self.params
        total = float(weights.sum())
        if total > 0.0:
            self.weights = weights / total
            # The mean likelihood, as the weights summed to 1. Upstream divides it by n once more: a smaller n looks
            # like a better fit, and a kidnapping goes unnoticed.
            likelihood = total * math.exp(min(likelihoods.log_scale, LARGEST_EXPONENT))
            self.slow_average = _averaged(self.slow_average, likelihood, params.recovery_alpha_slow)
            self.fast_average = _averaged(self.fast_average, likelihood, params.recovery_alpha_fast)
        else:
            self.weights = np.full(len(weights), 1.0 / len(weights))

    def _resample(self) -> None:
        """Resample (lines 12 to 19); with selective_resampling not while over half of the particles still count."""
        particles, weights, anywhere = self.particles, self.weights, self.fraction_anywhere
        if not (self.params.selective_resampling and particle_sets.effective_count(weights) > 0.5 * len(weights)):
            how = self._limits, anywhere, self._free_cells, self._rng
            self._replace(particle_sets.resample(particles, weights, *how))
            self.has_converged = bool(self._is_near(self.particles[:, :2].mean(axis=0)).all())
            if anywhere > 0.0:  # upstream: or the filter would spiral off into complete randomness
                self.slow_average = self.fast_average = 0.0
        self._take_statistics()

    def _replace(self, particles: np.ndarray) -> None:
        self.particles, self.weights = particles, np.full(len(particles), 1.0 / len(particles))

    def _take_statistics(self) -> None:
        self.statistics = particle_sets.particle_statistics(self.particles, self.weights)
        # Once and for all: the noise of a long move spreads particles, but not to other places.
        near = self._is_near(np.array(self.statistics[0][:2]))
        self.has_settled = self.has_settled or SETTLED_WEIGHT <= float(self.weights[near].sum())

    def _is_near(self, position_m: np.ndarray) -> np.ndarray:
        return np.asarray((np.abs(self.particles[:, :2] - position_m) <= CONVERGED_WITHIN_M).all(axis=1))

    def _restart(self, particles: np.ndarray) -> None:
        """Set particles of equal weight; the next scan is the first."""
        self._replace(particles)
        self.has_settled = self.has_converged = self._is_anywhere = False  # anywhere: without a given pose
        self._take_statistics()
        self.slow_average = self.fast_average = 0.0
        self._odom_pose, self._updates_since_restart = None, 0
        self._lost.restart_count()

    def _is_update_due(self, odom_pose: Pose2D) -> bool:
        # A lost robot, which should stand still, converges without motion, but only around a given pose: over a whole
        # map, or after a kidnapping, particles would converge to a similar wrong place.
        last, params = self._odom_pose, self.params
        if last is None or self._force_update or (self.is_lost and not (self.has_settled or self._is_anywhere)):
            return True
        moved_m = max(abs(odom_pose.x_m - last.x_m), abs(odom_pose.y_m - last.y_m))
        turned_rad = abs(wrap_angle(odom_pose.yaw_rad - last.yaw_rad))
        return moved_m > params.update_min_d or turned_rad > params.update_min_a


def _averaged(average: float, value: float, alpha: float) -> float:
    return value if average == 0.0 else average + alpha * (value - average)


RAYS, PARTICLES = 20, 20


def warm_up(params: AmclParams) -> None:
    """Run each kernel of a filter and of its scan check once: milliseconds with numba's cache, else some seconds."""
    counts = {'min_particles': PARTICLES, 'max_particles': PARTICLES}
    few = params.model_copy(update={**counts, 'resample_interval': 1, 'selective_resampling': False})
    grid, scan = square_room(), Scan(0, -math.pi, 2.0 * math.pi / RAYS, 0.1, 10.0, np.full(RAYS, 2.9))
    amcl = Amcl(few, grid, np.random.default_rng(0))
    amcl.update(IDENTITY, scan, IDENTITY)
    FitMap(grid, grid.resolution_m).fit(IDENTITY, scan, IDENTITY)
    model = laser_model(few, grid)
    model.likelihoods(amcl.particles, model.beams(scan, IDENTITY), True)  # beam skipping starts after convergence
