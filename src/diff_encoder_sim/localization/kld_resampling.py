"""Resampling: as many particles as their spread needs, a few of them anywhere.

KLD-sampling (Fox, IJRR 2003) with the recovery of augmented MCL (Probabilistic Robotics, table
8.3), as upstream's pf_update_resample combines them: draws from the cumulative weights, one at a
time, until there are enough for the bins that they fill. Upstream's draws are independent; these
are spread evenly, and add less noise to the mean.
"""

from __future__ import annotations

import functools
import math

import numpy as np

from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.free_cells import FreeCells
from diff_encoder_sim.localization.histogram import draw_until_enough

GOLDEN_SECTION = (math.sqrt(5.0) - 1.0) / 2.0


class LikelihoodAverages:
    """Slow and fast averages of the likelihood: the fast one falls below when the pose is wrong.

    Probabilistic Robotics, table 8.3, lines 10, 11 and 13.
    """

    def __init__(self, alpha_slow: float, alpha_fast: float) -> None:
        self._alpha_slow, self._alpha_fast = alpha_slow, alpha_fast
        self.reset()

    def reset(self) -> None:
        """Start anew with the next likelihood."""
        self.slow = self.fast = 0.0

    def add(self, likelihood: float) -> None:
        """Add the mean likelihood of one update."""
        self.slow = _averaged(self.slow, likelihood, self._alpha_slow)
        self.fast = _averaged(self.fast, likelihood, self._alpha_fast)

    def fraction_anywhere(self) -> float:
        """Return the fraction of particles to draw anywhere on the map, 0 to 1."""
        if self.slow == 0.0:
            return 0.0
        return max(0.0, 1.0 - self.fast / self.slow)


def _averaged(average: float, value: float, alpha: float) -> float:
    return value if average == 0.0 else average + alpha * (value - average)


def effective_count(weights: np.ndarray) -> float:
    """Return the effective sample size, 1 / sum of squared weights (weights sum to 1)."""
    return 1.0 / float((weights * weights).sum())


def kld_limits(params: AmclParams) -> np.ndarray:
    """Return (max_particles + 1,) particles needed where k bins are filled, by k."""
    return _kld_limits(params.kld_err, params.kld_z, params.min_particles, params.max_particles)


@functools.lru_cache(maxsize=8)  # of the last trials
def _kld_limits(kld_err: float, kld_z: float, min_particles: int, max_particles: int) -> np.ndarray:
    limits = kld_err, kld_z, min_particles, max_particles
    return np.array([kld_limit(bins, *limits) for bins in range(max_particles + 1)])


def kld_limit(bin_count: int, kld_err: float, kld_z: float, min_particles: int, max_particles: int) -> int:
    """Return how many particles keep the divergence from the posterior below `kld_err` (table 8.4).

    The Wilson-Hilferty approximation of the chi-square quantile with bin_count - 1 degrees of
    freedom. One bin gives no bound: the most particles, as upstream.
    """
    if bin_count <= 1:
        return max_particles
    freedom = bin_count - 1.0
    variance = 2.0 / (9.0 * freedom)
    root = 1.0 - variance + math.sqrt(variance) * kld_z
    count = math.ceil(freedom / (2.0 * kld_err) * root**3)
    return min(max(count, min_particles), max_particles)


def resample(
    particles: np.ndarray,
    weights: np.ndarray,
    limits: np.ndarray,
    fraction_anywhere: float,
    free_cells: FreeCells,
    rng: np.random.Generator,
) -> np.ndarray:
    """Draw (m, 3) particles of equal weight from a weighted set.

    Args:
        particles: (n, 3) base poses in the map.
        weights: (n,), sum 1.
        limits: from `kld_limits`; m is at most its length less 1.
        fraction_anywhere: probability that a particle is drawn from the whole map instead.
        free_cells: to draw those from.
        rng: drawn from as for the most particles, so that equal seeds stay in step.
    """
    most = len(limits) - 1
    places = even_places(most, rng.random())
    anywhere = rng.random((most, 3)) if fraction_anywhere > 0.0 else np.empty((0, 3))
    centres = free_cells.centres((anywhere[:, 1] * len(free_cells)).astype(int))
    return draw_until_enough(particles, np.cumsum(weights), limits, fraction_anywhere, centres, places, anywhere)


def even_places(count: int, offset: float) -> np.ndarray:
    """Return (count,) places of [0, 1), evenly spread: all of them, and nearly so the first of them, however many.

    All are those of systematic resampling, (k + offset) / count. Their order goes in steps of about the golden section,
    which parts every gap before it parts one twice.

    Args:
        count: at least 1.
        offset: 0 to 1, without 1.
    """
    step = round(GOLDEN_SECTION * count)
    while math.gcd(step, count) != 1:  # or some places would be visited twice
        step += 1
    places: np.ndarray = (np.arange(count) * step % count + offset) / count
    return places
