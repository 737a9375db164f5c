"""The particle set of the filter: moved by odometry, weighed by a scan, resampled.

Probabilistic Robotics, table 8.3, with its line numbers.
"""

from __future__ import annotations

import math

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.clusters import ParticleStatistics, particle_statistics
from diff_encoder_sim.localization.free_cells import FreeCells
from diff_encoder_sim.localization.kld_resampling import LikelihoodAverages, effective_count, kld_limits, resample
from diff_encoder_sim.localization.odometry_motion import motion_model
from diff_encoder_sim.localization.particles import CONVERGED_WITHIN_M, has_converged, weight_near
from diff_encoder_sim.localization.sensor import Likelihoods

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
    has_settled: bool  # most of the weight has been close together since the restart

    def __init__(self, params: AmclParams, particles: np.ndarray, rng: np.random.Generator) -> None:
        self._rng = rng
        self.reconfigure(params)
        self.restart(particles)

    def reconfigure(self, params: AmclParams) -> None:
        """Use other parameters; their number of particles from the next resampling on."""
        self._params = params
        self._motion_model = motion_model(params)
        self._limits = kld_limits(params)
        self.averages = LikelihoodAverages(params.recovery_alpha_slow, params.recovery_alpha_fast)

    def restart(self, particles: np.ndarray) -> None:
        """Replace the particles by others (n, 3), of equal weight."""
        self._replace(particles)
        self.has_settled = False
        self._take_statistics()
        self.has_converged = False
        self.averages.reset()

    def move(self, previous: Pose2D, current: Pose2D) -> None:
        """Move the particles as odometry moved the base, poses in odom (line 5)."""
        self.particles = self._motion_model(self.particles, previous, current, self._rng)

    def weigh(self, likelihoods: Likelihoods) -> None:
        """Multiply the weights by a scan's likelihoods (lines 6 to 11)."""
        weights = self.weights * likelihoods.factors
        total = float(weights.sum())
        if total > 0.0:
            self.weights = weights / total
            # The weights summed to 1, so the total is the mean likelihood. Upstream divides it by
            # n once more: an n that KLD-sampling has made smaller then looks like a better fit,
            # and a kidnapping goes unnoticed.
            self.averages.add(total * math.exp(min(likelihoods.log_scale, LARGEST_EXPONENT)))
        else:
            self.weights = np.full(len(weights), 1.0 / len(weights))

    def resample(self, free_cells: FreeCells) -> None:
        """Draw new particles (lines 12 to 19), if selective_resampling finds it due; random ones on free cells."""
        if not self._is_weight_spread():
            anywhere = self.averages.fraction_anywhere()
            self._replace(resample(self.particles, self.weights, self._limits, anywhere, free_cells, self._rng))
            self.has_converged = has_converged(self.particles)
            if anywhere > 0.0:
                # Upstream: or the filter would spiral off into complete randomness.
                self.averages.reset()
        self._take_statistics()

    def _replace(self, particles: np.ndarray) -> None:
        self.particles = particles
        self.weights = np.full(len(particles), 1.0 / len(particles))

    def _take_statistics(self) -> None:
        self.statistics = particle_statistics(self.particles, self.weights)
        # Once and for all: the noise of a long move spreads particles, but not to other places.
        self.has_settled = self.has_settled or SETTLED_WEIGHT <= weight_near(
            self.particles, self.weights, self.statistics.mean, CONVERGED_WITHIN_M
        )

    def _is_weight_spread(self) -> bool:
        """Return whether selective_resampling is on and over half of the particles still count."""
        return self._params.selective_resampling and effective_count(self.weights) > 0.5 * len(self.weights)
