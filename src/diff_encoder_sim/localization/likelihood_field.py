"""The likelihood field: the closer a ray ends to something on the map, the likelier the ray.

Probabilistic Robotics, table 6.3, with upstream's way of combining rays: one plus the sum of the
cubes of their probabilities. That is no probability, but it tolerates obstacles that are not on
the map.
"""

from __future__ import annotations

import logging
import math
from typing import NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.base.kernels import Array, compiled
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.beams import Beams, Likelihoods, SensorModel, beam_step_rounded_up
from diff_encoder_sim.localization.occupancy_grid import OCCUPIED, OccupancyGrid

# Stands for "no occupied cell in this column"; its square still fits an int64 with room to add.
_FAR = 1 << 28


class DistanceField(NamedTuple):
    """The distance from each cell's centre to that of the nearest occupied one.

    There are few different ones: what depends on the distance alone is computed for these, and looked up for each cell.
    """

    indices: np.ndarray  # (height, width) int32, of `distances_m`
    distances_m: np.ndarray  # (n,), rising; the last one is the largest that is told apart


def distance_field(occupied: np.ndarray, resolution_m: float, max_distance_m: float) -> DistanceField:
    """Return the distances from all cells.

    Args:
        occupied: (height, width) bool.
        resolution_m: side of a cell.
        max_distance_m: the value of cells that are farther than this from any occupied one.
    """
    height, width = occupied.shape
    # Squared, in cells. Larger ones are beyond the limit, or on no grid of this size.
    most = min(math.ceil(max_distance_m / resolution_m) ** 2, height**2 + width**2)
    distances_m = np.minimum(np.sqrt(np.arange(most + 1)) * resolution_m, max_distance_m)
    distances_m[most] = max_distance_m
    return DistanceField(_squared_distances(np.ascontiguousarray(occupied, dtype=np.bool_), most), distances_m)


@compiled
def _squared_distances(occupied: Array, most: int) -> np.ndarray:
    """Return (height, width) int32 squared distance in cells, at most `most`."""
    height, width = occupied.shape
    squared = np.empty((height, width), dtype=np.int32)
    _along_columns(occupied, squared)
    in_column = np.empty(width, dtype=np.int64)
    vertices = np.empty(width, dtype=np.int64)
    starts = np.empty(width, dtype=np.int64)
    for row in range(height):
        in_column[:] = squared[row]
        _along_row(in_column, squared[row], vertices, starts, most)
    return squared


@compiled
def _along_columns(occupied: Array, distance: Array) -> None:
    """Fill in the distance to the nearest occupied cell of the same column: once down, once up."""
    height, width = occupied.shape
    for column in range(width):
        distance[0, column] = 0 if occupied[0, column] else _FAR
    for row in range(1, height):
        for column in range(width):
            distance[row, column] = 0 if occupied[row, column] else min(distance[row - 1, column] + 1, _FAR)
    for row in range(height - 2, -1, -1):
        for column in range(width):
            distance[row, column] = min(distance[row, column], distance[row + 1, column] + 1)


@compiled
def _along_row(heights: Array, squared: Array, vertices: Array, starts: Array, most: int) -> None:
    """Fill in the lower envelope of the parabolas (x - v)^2 + heights[v]^2, in whole numbers, where it is below `most`.

    `vertices` and `starts` are scratch: the columns whose parabola is on the envelope, and the
    first column at which each is the lowest.
    """
    width = len(heights)
    count = 1
    vertices[0] = starts[0] = 0
    for column in range(1, width):
        crossing = 0
        while count > 0:
            vertex = vertices[count - 1]
            # From the crossing on, the later parabola is lower.
            crossing = (
                column * column
                - vertex * vertex
                + heights[column] * heights[column]
                - heights[vertex] * heights[vertex]
            ) // (2 * (column - vertex)) + 1
            if crossing > starts[count - 1]:
                break
            count -= 1
        if count == 0:
            crossing = 0
        if crossing < width:
            vertices[count] = column
            starts[count] = crossing
            count += 1
    index = 0
    for column in range(width):
        while index + 1 < count and starts[index + 1] <= column:
            index += 1
        offset = column - vertices[index]
        squared[column] = min(offset * offset + heights[vertices[index]] * heights[vertices[index]], most)


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
def sum_over_endpoints(poses: Array, ends: Array, table: Array) -> np.ndarray:
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
def count_at_endpoints(poses: Array, ends: Array, table: Array) -> np.ndarray:
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
