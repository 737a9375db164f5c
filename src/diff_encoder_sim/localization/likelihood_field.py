"""The likelihood field: the closer a ray ends to something on the map, the likelier the ray.

Probabilistic Robotics, table 6.3, with upstream's way of combining rays: one plus the sum of the
cubes of their probabilities. That is no probability, but it tolerates obstacles that are not on
the map.
"""

from __future__ import annotations

from typing import Optional, Tuple

import numpy as np

from diff_encoder_sim.base.compiled import compiled
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.beams import Beams
from diff_encoder_sim.localization.distance import distance_field
from diff_encoder_sim.localization.occupancy_grid import OCCUPIED, OccupancyGrid
from diff_encoder_sim.localization.sensor import Likelihoods, SensorModel

# Table entries are multiples of this, so that a sum of some hundred of them is exact in double
# precision: in whatever order the compiler's vectors add, the weights are equal.
_QUANTUM = 2.0**-36


class LikelihoodField(SensorModel):
    """Upstream's `likelihood_field`."""

    def __init__(self, params: AmclParams, grid: OccupancyGrid) -> None:
        super().__init__(params, grid)
        field = distance_field(grid.cells == OCCUPIED, grid.resolution_m, params.laser_likelihood_max_dist)
        # One cell wider all around: off the map, every obstacle is as far away as can be. It has an entry of its own.
        self._distances_m = np.append(field.distances_m, params.laser_likelihood_max_dist)
        self._cells = np.pad(field.indices, 1, constant_values=len(field.distances_m))
        self._table: Optional[Tuple[float, np.ndarray]] = None

    def likelihoods(self, particles: np.ndarray, beams: Beams, converged: bool) -> Likelihoods:
        """Weigh particles (n, 3) by how far from obstacles the beams end; see SensorModel."""
        sums = sum_over_endpoints(
            self._poses_in_cells(particles), self._ends_in_cells(beams), self._table_for(beams.range_max_m)
        )
        return Likelihoods(1.0 + sums, 0.0)

    def _table_for(self, range_max_m: float) -> np.ndarray:
        """Return (height + 2, width + 2) what a ray adds by the cell it ends in; once a range limit."""
        if self._table is None or self._table[0] != range_max_m:
            entries = self._entry(ray_probability(self._distances_m, self._params, range_max_m))
            self._table = (range_max_m, (np.round(entries / _QUANTUM) * _QUANTUM)[self._cells])
        return self._table[1]

    def _ends_in_cells(self, beams: Beams) -> np.ndarray:
        """Return (2, k) the rays' ends in the base frame, in cells."""
        return np.ascontiguousarray(beams.endpoints_in_base().T) / self._grid.resolution_m

    def _entry(self, probability: np.ndarray) -> np.ndarray:
        return probability**3


def ray_probability(distance_m: np.ndarray, params: AmclParams, range_max_m: float) -> np.ndarray:
    """Return how likely a ray ends `distance_m` from an obstacle: a hit, or anything (table 6.3, line 7)."""
    hit = np.exp(-(distance_m**2) / (2.0 * params.laser_sigma_hit**2))
    return params.laser_z_hit * hit + params.laser_z_rand / range_max_m


@compiled(fastmath={'reassoc', 'nsz'})
def sum_over_endpoints(
    poses: np.ndarray, ends: np.ndarray, table: np.ndarray
) -> np.ndarray:  # pragma: no cover (compiled)
    """Return (n,) sums of the table's entries where the rays end.

    Args:
        poses: (n, 4) column, row, cosine and sine of base in the grid's frame, in cells.
        ends: (2, k) the rays' ends in the base frame, in cells.
        table: (height + 2, width + 2) the map with a border of one cell around it.
    """
    height, width = table.shape
    entries = table.ravel()
    last_column, last_row = float(width - 1), float(height - 1)
    sums = np.empty(len(poses))
    for i in range(len(poses)):
        column, row, cos_yaw, sin_yaw = poses[i]
        total = 0.0
        for j in range(ends.shape[1]):
            # Clamped to the border, so that no test for rays off the map is needed.
            x = min(max(column + cos_yaw * ends[0, j] - sin_yaw * ends[1, j] + 1.0, 0.0), last_column)
            y = min(max(row + sin_yaw * ends[0, j] + cos_yaw * ends[1, j] + 1.0, 0.0), last_row)
            total += entries[int(y) * width + int(x)]
        sums[i] = total
    return sums


@compiled
def count_at_endpoints(
    poses: np.ndarray, ends: np.ndarray, table: np.ndarray
) -> np.ndarray:  # pragma: no cover (compiled)
    """Return (k,) sums over poses of the table's entries where each ray ends; see above."""
    height, width = table.shape
    counts = np.zeros(ends.shape[1], dtype=np.int64)
    for i in range(len(poses)):
        column, row, cos_yaw, sin_yaw = poses[i]
        for j in range(ends.shape[1]):
            x = min(max(column + cos_yaw * ends[0, j] - sin_yaw * ends[1, j] + 1.0, 0.0), width - 1.0)
            y = min(max(row + sin_yaw * ends[0, j] + cos_yaw * ends[1, j] + 1.0, 0.0), height - 1.0)
            counts[j] += table[int(y), int(x)]
    return counts
