"""The likelihood field with the rays' probabilities multiplied, and beam skipping.

Probabilistic Robotics, table 6.3, unchanged: upstream's likelihood_field_prob. Beam skipping
leaves out rays that for few particles end near anything on the map: people, moved furniture.
"""

from __future__ import annotations

import logging

import numpy as np

from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.beams import Beams, beam_step_rounded_up
from diff_encoder_sim.localization.likelihood_field import LikelihoodField, count_at_endpoints, sum_over_endpoints
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.localization.sensor import Likelihoods

log = logging.getLogger(__name__)

# Replaces the logarithm of a probability of zero, which a sum of logarithms cannot hold.
_LEAST_LOG = -700.0


class LikelihoodFieldProb(LikelihoodField):
    """Upstream's `likelihood_field_prob`."""

    def __init__(self, params: AmclParams, grid: OccupancyGrid) -> None:
        super().__init__(params, grid)
        is_near = self._distances_m < params.beam_skip_distance
        is_near[-1] = False  # off the map no ray agrees, however large beam_skip_distance is
        self._is_near = is_near[self._cells]

    def likelihoods(self, particles: np.ndarray, beams: Beams, converged: bool) -> Likelihoods:
        """Weigh particles (n, 3), the largest factor being 1; see SensorModel."""
        poses, ends = self._poses_in_cells(particles), self._ends_in_cells(beams)
        if self._params.do_beamskip and converged:
            ends = np.ascontiguousarray(ends[:, self._agreed_beams(poses, ends)])
        logs = sum_over_endpoints(poses, ends, self._table_for(beams.range_max_m))
        # Upstream multiplies the probabilities themselves: 180 unlikely rays make that zero for all.
        largest = float(logs.max())
        return Likelihoods(np.exp(logs - largest), largest)

    def _agreed_beams(self, poses: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Return (k,) which rays for enough particles end near something on the map, or all rays.

        All, with a warning, where beam_skip_error_threshold or more would be left out.

        Args:
            poses: (n, 4) column, row, cosine and sine of base in the grid's frame, in cells.
            ends: (2, k) the rays' ends in the base frame, in cells.
        """
        agreeing = count_at_endpoints(poses, ends, self._is_near)
        kept = agreeing > self._params.beam_skip_threshold * len(poses)
        skipped = 1.0 - float(kept.mean())
        if skipped >= self._params.beam_skip_error_threshold:
            log.warning(
                '%.0f %% of the rays disagree with the map: the pose may be wrong; all are used', 100.0 * skipped
            )
            return np.ones_like(kept)
        return kept

    def _step(self, ray_count: int) -> int:
        return beam_step_rounded_up(ray_count, self._params.laser_max_beams)

    def _entry(self, probability: np.ndarray) -> np.ndarray:
        with np.errstate(divide='ignore'):
            entries: np.ndarray = np.maximum(np.log(probability), _LEAST_LOG)
        return entries
