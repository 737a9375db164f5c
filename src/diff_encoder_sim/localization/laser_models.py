"""The laser models by the names of laser_model_type."""

from __future__ import annotations

import math
from typing import Dict, Type

import numpy as np

from diff_encoder_sim.base.kernels import Array, compiled
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.beams import Beams, Likelihoods, SensorModel
from diff_encoder_sim.localization.likelihood_field import LikelihoodField, LikelihoodFieldProb
from diff_encoder_sim.localization.occupancy_grid import FREE, OccupancyGrid


class BeamModel(SensorModel):
    """Upstream's `beam`."""

    # In this model a ray without a return counts: laser_z_max.
    _hits_only = False

    def __init__(self, params: AmclParams, grid: OccupancyGrid) -> None:
        super().__init__(params, grid)
        # As upstream: a ray ends at a cell that is unknown, and at the border.
        self._blocked = np.ascontiguousarray(grid.cells != FREE)
        weights = (params.laser_z_hit, params.laser_z_short, params.laser_z_max, params.laser_z_rand)
        self._mixture = np.array([*weights, params.laser_sigma_hit, params.laser_lambda_short])

    def likelihoods(self, particles: np.ndarray, beams: Beams, converged: bool) -> Likelihoods:
        """Weigh particles (n, 3) by the ranges that the map has along the beams; see SensorModel."""
        poses, cell_m = self._poses_in_cells(particles), self._grid.resolution_m
        laser = np.array([beams.laser_x_m, beams.laser_y_m]) / cell_m
        directions = np.stack([np.cos(beams.bearings_rad), np.sin(beams.bearings_rad)])
        measured = beams.ranges_m, beams.range_max_m
        return Likelihoods(
            _weigh_by_casting(poses, laser, directions, *measured, self._blocked, cell_m, self._mixture), 0.0
        )


@compiled
def _weigh_by_casting(
    poses: Array,
    laser: Array,
    directions: Array,
    ranges_m: Array,
    range_max_m: float,
    blocked: Array,
    resolution_m: float,
    mixture: Array,
) -> np.ndarray:
    """Return (n,) one plus the sum over rays of their probability cubed.

    Args:
        poses: (n, 4) column, row, cosine and sine of base in the grid's frame, in cells.
        laser: (2,) x, y of the laser in the base frame, in cells.
        directions: (2, k) cosine and sine of each ray's bearing in the base frame.
        ranges_m: (k,) measured ranges.
        range_max_m: the range that stands for no return.
        blocked: (height, width) bool.
        resolution_m: side of a cell.
        mixture: see `ray_probability`.
    """
    factors = np.empty(len(poses))
    reach = range_max_m / resolution_m
    for i in range(len(poses)):
        column, row, cos_yaw, sin_yaw = poses[i]
        column += cos_yaw * laser[0] - sin_yaw * laser[1]
        row += sin_yaw * laser[0] + cos_yaw * laser[1]
        factor = 1.0
        for j in range(len(ranges_m)):
            expected_m = resolution_m * cast_ray(
                blocked,
                column,
                row,
                column + reach * (cos_yaw * directions[0, j] - sin_yaw * directions[1, j]),
                row + reach * (sin_yaw * directions[0, j] + cos_yaw * directions[1, j]),
                reach,
            )
            factor += ray_probability(ranges_m[j], expected_m, range_max_m, mixture) ** 3
        factors[i] = factor
    return factors


@compiled
def ray_probability(range_m: float, expected_m: float, range_max_m: float, mixture: Array) -> float:
    """Return how likely a range is where the map has `expected_m`: table 6.1 without its normalisers.

    `mixture` is z_hit, z_short, z_max, z_rand, sigma_hit [m], lambda_short [1/m].
    """
    z_hit, z_short, z_max, z_rand, sigma_hit_m, lambda_short = mixture
    excess_m = range_m - expected_m
    probability: float = z_hit * math.exp(-(excess_m**2) / (2.0 * sigma_hit_m**2))
    if excess_m < 0.0:
        probability += z_short * lambda_short * math.exp(-lambda_short * range_m)
    if range_m >= range_max_m:
        probability += z_max
    else:
        probability += z_rand / range_max_m
    return probability


@compiled
def cast_ray(blocked: Array, column: float, row: float, end_column: float, end_row: float, reach: float) -> float:
    """Return how many cells lie between a point and the first blocked cell on the line to another.

    Measured between cell centres along Bresenham's line; the cell it starts in does not block it.
    Where none does, the length is `reach`.
    """
    height, width = blocked.shape
    x, y = int(math.floor(column)), int(math.floor(row))
    start_x, start_y = x, y
    span_x, span_y = int(math.floor(end_column)) - x, int(math.floor(end_row)) - y
    step_x, step_y = (1 if span_x > 0 else -1), (1 if span_y > 0 else -1)
    span_x, span_y = abs(span_x), abs(span_y)
    is_steep = span_y > span_x
    longer, shorter = (span_y, span_x) if is_steep else (span_x, span_y)
    error = 0
    # Upstream checks one cell past the end.
    for _ in range(longer + 1):
        error += shorter
        sidestep = 2 * error >= longer
        if sidestep:
            error -= longer
        if is_steep or sidestep:
            y += step_y
        if sidestep or not is_steep:
            x += step_x
        if x < 0 or y < 0 or x >= width or y >= height or blocked[y, x]:
            return math.hypot(x - start_x, y - start_y)
    return reach


LASER_MODELS: Dict[str, Type[SensorModel]] = {
    'beam': BeamModel,
    'likelihood_field': LikelihoodField,
    'likelihood_field_prob': LikelihoodFieldProb,
}


def laser_model(params: AmclParams, grid: OccupancyGrid) -> SensorModel:
    """Build the model that laser_model_type names, for one map."""
    return LASER_MODELS[params.laser_model_type](params, grid)
