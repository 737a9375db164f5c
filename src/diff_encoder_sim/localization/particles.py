"""Particle sets: how they are drawn, how far they are spread, and which input is refused.

A set is an array (n, 3) of base poses in the map, x [m], y [m], yaw [rad] in [-pi, pi), with
weights (n,) that sum to 1.
"""

from __future__ import annotations

import math
from statistics import NormalDist
from typing import NamedTuple

import numpy as np

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D, wrap_angle, wrap_angles
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.histogram import (
    GOLDEN_SECTION,
    ParticleStatistics,
    effective_count,
    kld_limits,
    particle_statistics,
    resample,
)
from diff_encoder_sim.localization.laser_models import Likelihoods
from diff_encoder_sim.localization.occupancy_grid import FREE, FreeCells, OccupancyGrid

# Below this distance [m] the direction between two poses is noise (a turn on the spot): upstream's.
SMALL_TRANSLATION_M = 0.01


class Move(NamedTuple):
    """The three parts of an odometry move, or their standard deviations."""

    rotation1_rad: float
    translation_m: float
    rotation2_rad: float


def decompose(previous: Pose2D, current: Pose2D) -> Move:
    """Compute the move between two base poses in odom (table 5.6, lines 2 to 4)."""
    x_m, y_m = current.x_m - previous.x_m, current.y_m - previous.y_m
    translation_m = math.hypot(x_m, y_m)
    rotation1_rad = wrap_angle(math.atan2(y_m, x_m) - previous.yaw_rad) if translation_m >= SMALL_TRANSLATION_M else 0.0
    return Move(rotation1_rad, translation_m, wrap_angle(current.yaw_rad - previous.yaw_rad - rotation1_rad))


def move_noise(move: Move, params: AmclParams) -> Move:
    """Return a move's standard deviations [rad, m, rad] (table 5.6, lines 5 to 7).

    Upstream's older model `diff`, its default, passes the variance to a sampler that takes a standard deviation. Users
    have tuned their alphas on it, so it is kept as upstream; below 1 rad and 1 m it trusts odometry more than its
    alphas specify.
    """
    # Relative to forward or reverse, whichever is closer: both are equally noisy.
    turn1, turn2 = (
        min(abs(wrap_angle(turn_rad)), abs(wrap_angle(turn_rad - math.pi))) ** 2
        for turn_rad in (move.rotation1_rad, move.rotation2_rad)
    )
    drive = move.translation_m**2
    variances = Move(
        params.odom_alpha1 * turn1 + params.odom_alpha2 * drive,
        params.odom_alpha3 * drive + params.odom_alpha4 * (turn1 + turn2),
        params.odom_alpha1 * turn2 + params.odom_alpha2 * drive,
    )
    return Move(*map(math.sqrt, variances)) if params.odom_model_type == 'diff-corrected' else variances


def move_particles(
    particles: np.ndarray, previous: Pose2D, current: Pose2D, params: AmclParams, rng: np.random.Generator
) -> np.ndarray:
    """Move each particle (n, 3) by its own noisy copy of odometry's move between two base poses in odom (table 5.6).

    A robot whose base frame is off the axle moves it sideways when it turns on the spot. To table 5.6 that is a turn of
    90 degrees, a drive, and a turn back, each with its noise, of which none happened. So the axle is moved. `rng` is
    drawn from 3 n times, whatever the move, so that equal seeds stay in step.
    """
    if not params.axle_x:
        return _sampled(particles, previous, current, params, rng)
    axle_in_base = Pose2D(params.axle_x, 0.0, 0.0)
    axles = _moved_ahead(particles, params.axle_x)
    moved = _sampled(axles, previous.compose(axle_in_base), current.compose(axle_in_base), params, rng)
    return _moved_ahead(moved, -params.axle_x)


def _moved_ahead(poses: np.ndarray, by_m: float) -> np.ndarray:
    """Return (n, 3) poses moved along their own x axes."""
    moved = poses.copy()
    moved[:, 0] += by_m * np.cos(poses[:, 2])
    moved[:, 1] += by_m * np.sin(poses[:, 2])
    return moved


def _sampled(
    particles: np.ndarray, previous: Pose2D, current: Pose2D, params: AmclParams, rng: np.random.Generator
) -> np.ndarray:
    """Return (n, 3) poses after noisy copies of a move (lines 5 to 11)."""
    move = decompose(previous, current)
    normals, sigmas = rng.standard_normal(particles.shape), move_noise(move, params)
    rotation1_rad, translation_m, rotation2_rad = (
        part - sigma * normals[:, column] for column, (part, sigma) in enumerate(zip(move, sigmas))
    )
    direction_rad = particles[:, 2] + rotation1_rad
    moved = np.empty_like(particles)
    moved[:, 0] = particles[:, 0] + translation_m * np.cos(direction_rad)
    moved[:, 1] = particles[:, 1] + translation_m * np.sin(direction_rad)
    moved[:, 2] = wrap_angles(direction_rad + rotation2_rad)
    return moved


# Upstream's pf_alloc: the filter has converged when no particle is farther than this from the
# mean, along x or y [m].
CONVERGED_WITHIN_M = 0.5

# A larger coordinate is on no map, and would not fit the histogram's keys [m].
LARGEST_COORDINATE_M = 1e6

# Steps of the first particles' places in x, y and yaw: the golden section and roots, which no whole numbers relate.
EVEN_STEPS = (GOLDEN_SECTION, math.sqrt(2.0), math.sqrt(3.0))

# 0 has no normal quantile.
LEAST_CHANCE = 1e-12

# Side of a map's cells [m]: others are mistyped, and end as coordinates that are not finite.
SMALLEST_CELL_M, LARGEST_CELL_M = 1e-3, 100.0


def particles_around(pose: Pose2D, covariance: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Draw (count, 3) particles from a Gaussian about `pose` (base in the map).

    The x, y and yaw-yaw entries of the 3x3 `covariance` count, as upstream reads /initialpose.
    """
    variances, axes = np.linalg.eigh(np.asarray(covariance, dtype=float)[:2, :2])
    sigmas = np.sqrt(np.maximum(variances, 0.0))
    normals = even_normals(count, rng)
    particles = np.empty((count, 3))
    for row in (0, 1):
        particles[:, row] = (
            pose[row] + axes[row, 0] * sigmas[0] * normals[:, 0] + axes[row, 1] * sigmas[1] * normals[:, 1]
        )
    particles[:, 2] = wrap_angles(pose.yaw_rad + np.sqrt(covariance[2][2]) * normals[:, 2])
    return particles


def even_normals(count: int, rng: np.random.Generator) -> np.ndarray:
    """Sample (count, 3) evenly spread standard normal numbers, with a mean closer to 0 than independent samples.

    A Kronecker sequence (Niederreiter, 1992) with a random offset, through the inverse of the normal distribution.
    Scans in a hallway contain little information: an error of the initial mean persists for tens of metres.
    """
    places = np.maximum((rng.random(3) + np.outer(np.arange(count), EVEN_STEPS)) % 1.0, LEAST_CHANCE)
    return np.array([*map(NormalDist().inv_cdf, places.ravel().tolist())]).reshape(count, 3)


def particles_everywhere(free_cells: FreeCells, count: int, rng: np.random.Generator) -> np.ndarray:
    """Draw (count, 3) particles, uniform over the free cells and over all headings."""
    particles = np.empty((count, 3))
    particles[:, :2] = free_cells.centres(rng.integers(0, len(free_cells), count))
    particles[:, 2] = rng.uniform(-np.pi, np.pi, count)
    return particles


def check_grid(grid: OccupancyGrid) -> None:
    """Refuse a map on which no robot can be located.

    Raises:
        InputFault: no free cell, or an invalid resolution or origin.
    """
    if not SMALLEST_CELL_M <= grid.resolution_m <= LARGEST_CELL_M:
        allowed = f'{SMALLEST_CELL_M:g} to {LARGEST_CELL_M:g} m'
        raise InputFault(f'map: given a resolution of {grid.resolution_m} m; allowed: {allowed}')
    check_pose(grid.origin, 'map origin')
    if not (grid.cells == FREE).any():
        raise InputFault('map: no cell is free; expected free space around the robot')


def check_pose(pose: Pose2D, name: str) -> None:
    """Refuse an invalid pose; `name` names it in the error.

    Raises:
        InputFault: a coordinate is not finite or too large.
    """
    if not (max(abs(pose.x_m), abs(pose.y_m)) <= LARGEST_COORDINATE_M and math.isfinite(sum(pose))):
        raise InputFault(
            f'{name}: given ({pose.x_m}, {pose.y_m}, {pose.yaw_rad}); expected finite x, y [m] and yaw [rad]'
        )


def check_covariance(covariance: np.ndarray) -> None:
    """Refuse an invalid 3x3 covariance over (x, y, yaw).

    Raises:
        InputFault: not finite, too large, or a variance below zero.
    """
    covariance = np.asarray(covariance, dtype=float)
    if not (np.abs(covariance) <= LARGEST_COORDINATE_M**2).all() or (np.diag(covariance) < 0.0).any():
        raise InputFault(
            f'initial covariance: given {covariance.tolist()}; expected finite numbers and no variance below 0'
        )


# The exponential of a larger number overflows a double.
LARGEST_EXPONENT = 700.0

# The particles have settled when this fraction of their weight lies as close together as in a
# converged set: recovery may have drawn the rest anywhere.
SETTLED_WEIGHT = 0.9


class ParticleSet:
    """Particles and weights: arrays that are replaced, never changed."""

    particles: np.ndarray  # (n, 3) base poses in the map, x [m], y [m], yaw [rad]
    weights: np.ndarray  # (n,), sum 1
    statistics: ParticleStatistics  # as of the last restart or resampling
    has_converged: bool  # all particles were close together at the last resampling: upstream's
    slow_average: float  # of the scans' likelihoods (table 8.3, lines 10 and 11)
    fast_average: float
    has_settled: bool  # most of the weight has been close together since the restart

    def __init__(self, params: AmclParams, particles: np.ndarray, rng: np.random.Generator) -> None:
        self._rng = rng
        self.reconfigure(params)
        self.restart(particles)

    def reconfigure(self, params: AmclParams) -> None:
        """Use other parameters; their number of particles from the next resampling on."""
        self._params = params
        self._limits = kld_limits(params)
        self._reset_averages()

    def restart(self, particles: np.ndarray) -> None:
        """Replace the particles by others (n, 3), of equal weight."""
        self._replace(particles)
        self.has_settled = False
        self._take_statistics()
        self.has_converged = False
        self._reset_averages()

    def move(self, previous: Pose2D, current: Pose2D) -> None:
        """Move the particles as odometry moved the base, poses in odom (line 5)."""
        self.particles = move_particles(self.particles, previous, current, self._params, self._rng)

    def weigh(self, likelihoods: Likelihoods) -> None:
        """Multiply the weights by a scan's likelihoods (lines 6 to 11)."""
        weights = self.weights * likelihoods.factors
        total = float(weights.sum())
        if total > 0.0:
            self.weights = weights / total
            # The weights summed to 1, so the total is the mean likelihood. Upstream divides it by
            # n once more: an n that KLD-sampling has made smaller then looks like a better fit,
            # and a kidnapping goes unnoticed.
            likelihood = total * math.exp(min(likelihoods.log_scale, LARGEST_EXPONENT))
            self.slow_average = _averaged(self.slow_average, likelihood, self._params.recovery_alpha_slow)
            self.fast_average = _averaged(self.fast_average, likelihood, self._params.recovery_alpha_fast)
        else:
            self.weights = np.full(len(weights), 1.0 / len(weights))

    def resample(self, free_cells: FreeCells) -> None:
        """Draw new particles (lines 12 to 19), if selective_resampling finds it due; random ones on free cells."""
        # With selective_resampling not while over half of the particles still count.
        if not (self._params.selective_resampling and effective_count(self.weights) > 0.5 * len(self.weights)):
            anywhere = self.fraction_anywhere()
            self._replace(resample(self.particles, self.weights, self._limits, anywhere, free_cells, self._rng))
            mean = self.particles[:, :2].mean(axis=0)
            self.has_converged = bool(self._is_near(mean).all())
            if anywhere > 0.0:
                # Upstream: or the filter would spiral off into complete randomness.
                self._reset_averages()
        self._take_statistics()

    def fraction_anywhere(self) -> float:
        """Return the fraction of particles to draw anywhere on the map, 0 to 1 (table 8.3, line 13).

        The fast average of the likelihood falls below the slow one when the pose is wrong.
        """
        return max(0.0, 1.0 - self.fast_average / self.slow_average) if self.slow_average else 0.0

    def _reset_averages(self) -> None:
        self.slow_average = self.fast_average = 0.0

    def _replace(self, particles: np.ndarray) -> None:
        self.particles = particles
        self.weights = np.full(len(particles), 1.0 / len(particles))

    def _take_statistics(self) -> None:
        self.statistics = particle_statistics(self.particles, self.weights)
        # Once and for all: the noise of a long move spreads particles, but not to other places.
        near = self._is_near(np.array(self.statistics.mean[:2]))
        self.has_settled = self.has_settled or SETTLED_WEIGHT <= float(self.weights[near].sum())

    def _is_near(self, position_m: np.ndarray) -> np.ndarray:
        """Return (n,) which particles are close to a position, along x and y."""
        near: np.ndarray = (np.abs(self.particles[:, :2] - position_m) <= CONVERGED_WITHIN_M).all(axis=1)
        return near


def _averaged(average: float, value: float, alpha: float) -> float:
    return value if average == 0.0 else average + alpha * (value - average)
