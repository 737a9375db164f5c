"""The laser models of amcl, by the names of laser_model_type: the likelihood of a scan at each particle.

Likelihood field (Probabilistic Robotics, table 6.3): by the distance from a ray's end to an obstacle of the map. Beam
model (table 6.1): by the difference between its range and the map's. Upstream combines rays as one plus the sum of the
cubes of their probabilities, which tolerates obstacles that are not on the map.
"""

from __future__ import annotations

import logging
import math
from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.kernels import Array, compiled
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, OccupancyGrid, distance_field

log = logging.getLogger(__name__)

_QUANTUM = 2.0**-36  # of table entries: sums of some hundred of them are exact, in any order in which vectors add
_LEAST_LOG = -700.0  # replaces the logarithm of a probability of zero


class Beams(NamedTuple):
    """The rays of a scan that weigh the particles, in the base frame; a range of `range_max_m` is no return."""

    ranges_m: np.ndarray  # (k,), 0 to range_max_m
    bearings_rad: np.ndarray  # (k,) in the base frame
    laser_x_m: float  # where all rays start, in the base frame
    laser_y_m: float
    range_max_m: float


def check_scan(scan: Scan, range_max_m: float) -> None:
    """Raise InputFault for a scan without rays, without a direction for each, or without a limit of their ranges."""
    count, first_rad, step_rad = len(scan.ranges_m), scan.angle_min_rad, scan.angle_increment_rad
    if count == 0 or not math.isfinite(first_rad + step_rad * count) or (count > 1 and step_rad == 0.0):
        raise InputFault(
            f'{count} ranges from angle_min {first_rad} by angle_increment {step_rad} rad; expected at least one, '
            'each in a different direction'
        )
    if not 0.0 < range_max_m < math.inf:
        raise InputFault(f'range_max {range_max_m} m; expected a finite number greater than 0')


class Likelihoods(NamedTuple):
    """The likelihood of a scan for each particle, factors[i] * exp(log_scale): a product may not fit a double."""

    factors: np.ndarray  # (n,), 0 or more
    log_scale: float


class SensorModel:
    """A laser model on one map."""

    _hits_only = True  # the likelihood fields ignore rays without a return

    def __init__(self, params: AmclParams, grid: OccupancyGrid) -> None:
        self._params, self._grid = params, grid
        self._is_product = params.laser_model_type == 'likelihood_field_prob'

    def beams(self, scan: Scan, laser_pose_in_base: Pose2D) -> Beams:
        """Select the rays of a scan that count: evenly spaced, numbers, and in likelihood fields with a return.

        Readings out of range are no return, as upstream. Raises InputFault if no ray counts, or the scan is invalid.
        """
        params, range_max_m, range_min_m = self._params, float(scan.range_max_m), float(scan.range_min_m)
        if params.laser_max_range > 0.0:
            range_max_m = min(range_max_m, params.laser_max_range)
        if params.laser_min_range > 0.0:
            range_min_m = max(range_min_m, params.laser_min_range)
        check_scan(scan, range_max_m)
        if not (0.0 <= range_min_m < math.inf):
            raise InputFault(f'range_min {range_min_m} m; expected a finite number of at least 0')
        count, most = len(scan.ranges_m), params.laser_max_beams
        # As upstream: never more than `most` rays in likelihood_field_prob, else 200 of 1000 if `most` is 180.
        step = math.ceil(count / most) if self._is_product else max(1, (count - 1) // (most - 1))
        # A copy, as the kernel is compiled for one kind of array.
        used_m, limits_m = np.array(scan.ranges_m[::step], dtype=float), (range_min_m, range_max_m)
        directions_rad = scan.angle_min_rad, scan.angle_increment_rad * step, laser_pose_in_base.yaw_rad
        ranges_m, bearings_rad = _rays_in_base(used_m, limits_m, self._hits_only, directions_rad)
        if len(ranges_m) == 0:
            raise InputFault(
                f'none of {count} rays, as far as they are used, has a return within {range_max_m:g} m: it cannot '
                'localize the robot'
            )
        return Beams(ranges_m, bearings_rad, laser_pose_in_base.x_m, laser_pose_in_base.y_m, range_max_m)

    def likelihoods(self, particles: np.ndarray, beams: Beams, converged: bool) -> Likelihoods:
        """Weigh particles (n, 3), base poses in the map, by a scan's beams; `converged`: they lie close together."""
        raise NotImplementedError

    def _poses_in_cells(self, particles: np.ndarray) -> np.ndarray:
        """Return (n, 4): particles as column, row (with fractions), cosine and sine in the grid's frame."""
        origin, cell_m = self._grid.origin, self._grid.resolution_m
        cos_origin, sin_origin = np.cos(origin.yaw_rad), np.sin(origin.yaw_rad)
        x_m, y_m = particles[:, 0] - origin.x_m, particles[:, 1] - origin.y_m
        yaw_rad = particles[:, 2] - origin.yaw_rad
        columns = (cos_origin * x_m + sin_origin * y_m) / cell_m
        rows = (cos_origin * y_m - sin_origin * x_m) / cell_m
        return np.column_stack([columns, rows, np.cos(yaw_rad), np.sin(yaw_rad)])


class LikelihoodField(SensorModel):
    """Upstream's `likelihood_field`, and `likelihood_field_prob`, which multiplies the rays' probabilities."""

    def __init__(self, params: AmclParams, grid: OccupancyGrid) -> None:
        super().__init__(params, grid)
        field = distance_field(grid.cells == OCCUPIED, grid.resolution_m, params.laser_likelihood_max_dist)
        # Padded by one cell: off the map the distance is the maximum, a separate entry.
        self._distances_m = np.append(field.distances_m, params.laser_likelihood_max_dist)
        self._cells = np.pad(field.indices, 1, constant_values=len(field.distances_m))
        self._table: Tuple[float, np.ndarray] = 0.0, np.empty((0, 0))  # of a range limit

    def likelihoods(self, particles: np.ndarray, beams: Beams, converged: bool) -> Likelihoods:
        """Weigh particles (n, 3) by how far from obstacles the beams end; see SensorModel."""
        poses, x_m = self._poses_in_cells(particles), beams.laser_x_m + beams.ranges_m * np.cos(beams.bearings_rad)
        y_m = beams.laser_y_m + beams.ranges_m * np.sin(beams.bearings_rad)
        ends = np.stack([x_m, y_m]) / self._grid.resolution_m
        if self._is_product and self._params.do_beamskip and converged:
            ends = np.ascontiguousarray(ends[:, self._agreed_beams(poses, ends)])
        sums = sum_over_endpoints(poses, ends, self._table_for(beams.range_max_m))
        if not self._is_product:
            return Likelihoods(1.0 + sums, 0.0)
        largest = float(sums.max())  # 180 unlikely rays make upstream's products zero for all particles
        return Likelihoods(np.exp(sums - largest), largest)

    def _table_for(self, range_max_m: float) -> np.ndarray:
        """Return (height + 2, width + 2) what a ray adds by the cell it ends in; computed once for a range limit."""
        if self._table[0] != range_max_m:
            params = self._params
            hit = np.exp(-(self._distances_m**2) / (2.0 * params.laser_sigma_hit**2))
            probabilities = params.laser_z_hit * hit + params.laser_z_rand / range_max_m  # table 6.3, line 7
            with np.errstate(divide='ignore'):
                entries = np.maximum(np.log(probabilities), _LEAST_LOG) if self._is_product else probabilities**3
            self._table = range_max_m, (np.round(entries / _QUANTUM) * _QUANTUM)[self._cells]
        return self._table[1]

    def _agreed_beams(self, poses: np.ndarray, ends: np.ndarray) -> np.ndarray:
        """Return (k,) which rays end near an obstacle for enough particles; all if too many would be left out."""
        is_near = self._distances_m < self._params.beam_skip_distance
        is_near[-1] = False  # off the map no ray agrees, however large beam_skip_distance is
        column, row, cos_yaw, sin_yaw = poses.T[:, :, np.newaxis]
        last_row, last_column = np.subtract(self._cells.shape, 1)
        columns = np.clip(column + cos_yaw * ends[0] - sin_yaw * ends[1] + 1.0, 0, last_column).astype(int)
        rows = np.clip(row + sin_yaw * ends[0] + cos_yaw * ends[1] + 1.0, 0, last_row).astype(int)
        agreeing = is_near[self._cells[rows, columns]].sum(axis=0)
        kept: np.ndarray = agreeing > self._params.beam_skip_threshold * len(poses)
        skipped = 1.0 - float(kept.mean())
        if skipped < self._params.beam_skip_error_threshold:
            return kept
        log.warning('%.0f %% of the rays disagree with the map: the pose may be wrong; all are used', 100.0 * skipped)
        return np.ones_like(kept)


class BeamModel(SensorModel):
    """Upstream's `beam`."""

    _hits_only = False  # a ray without a return counts: laser_z_max

    def __init__(self, params: AmclParams, grid: OccupancyGrid) -> None:
        super().__init__(params, grid)
        self._blocked = np.ascontiguousarray(grid.cells != FREE)  # as upstream, unknown cells end rays, too
        weights = (params.laser_z_hit, params.laser_z_short, params.laser_z_max, params.laser_z_rand)
        self._mixture = (*weights, params.laser_sigma_hit, params.laser_lambda_short)

    def likelihoods(self, particles: np.ndarray, beams: Beams, converged: bool) -> Likelihoods:
        """Weigh particles (n, 3) by the ranges that the map has along the beams; see SensorModel."""
        poses, cell_m = self._poses_in_cells(particles), self._grid.resolution_m
        return Likelihoods(_weigh_by_casting(poses, beams, self._blocked, cell_m, self._mixture), 0.0)


@compiled
def _rays_in_base(
    ranges_m: Array, limits_m: Tuple[float, float], hits_only: bool, directions_rad: Tuple[float, float, float]
) -> Tuple[np.ndarray, np.ndarray]:
    """Return (k,) ranges and bearings in the base of the rays (n,) that are numbers; directions: first, step, yaw."""
    (range_min_m, range_max_m), (first_rad, step_rad, laser_yaw_rad) = limits_m, directions_rad
    kept_m, bearings_rad, count = np.empty(len(ranges_m)), np.empty(len(ranges_m)), 0
    for ray in range(len(ranges_m)):
        range_m = ranges_m[ray]
        if range_m <= range_min_m or range_m > range_max_m:
            range_m = range_max_m
        if math.isnan(range_m) or (hits_only and range_m >= range_max_m):
            continue
        kept_m[count] = range_m
        bearings_rad[count] = laser_yaw_rad + (first_rad + step_rad * ray)
        count += 1
    return kept_m[:count], bearings_rad[:count]


@compiled(fastmath={'reassoc', 'nsz'})
def sum_over_endpoints(poses: Array, ends: Array, table: Array) -> np.ndarray:
    """Return (n,) sums of the table's entries at the ends (2, k) of the rays [cells in the base frame].

    `poses` (n, 4) of `_poses_in_cells`; the table (height + 2, width + 2) has a border of one cell around the map.
    """
    height, width = table.shape
    entries = table.ravel()
    last_column, last_row, sums = float(width - 1), float(height - 1), np.empty(len(poses))
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
def _weigh_by_casting(
    poses: Array, beams: Beams, blocked: Array, cell_m: float, mixture: Tuple[float, float, float, float, float, float]
) -> np.ndarray:
    """Return (n,) one plus the sum over rays of their probability cubed: table 6.1 without its normalisers.

    `poses` (n, 4) of `_poses_in_cells`, `blocked` (height, width) bool.
    """
    z_hit, z_short, z_max, z_rand, sigma_hit_m, lambda_short = mixture
    ranges_m, range_max_m, reach = beams.ranges_m, beams.range_max_m, beams.range_max_m / cell_m
    cosines, sines = np.cos(beams.bearings_rad), np.sin(beams.bearings_rad)
    laser_x, laser_y = beams.laser_x_m / cell_m, beams.laser_y_m / cell_m
    factors = np.empty(len(poses))
    for i in range(len(poses)):
        column, row, cos_yaw, sin_yaw = poses[i]
        column += cos_yaw * laser_x - sin_yaw * laser_y
        row += sin_yaw * laser_x + cos_yaw * laser_y
        factor = 1.0
        for j in range(len(ranges_m)):
            end_column = column + reach * (cos_yaw * cosines[j] - sin_yaw * sines[j])
            end_row = row + reach * (sin_yaw * cosines[j] + cos_yaw * sines[j])
            excess_m = ranges_m[j] - cell_m * cast_ray(blocked, column, row, end_column, end_row, reach)
            probability = z_hit * math.exp(-(excess_m**2) / (2.0 * sigma_hit_m**2))
            if excess_m < 0.0:
                probability += z_short * lambda_short * math.exp(-lambda_short * ranges_m[j])
            probability += z_max if ranges_m[j] >= range_max_m else z_rand / range_max_m
            factor += probability**3
        factors[i] = factor
    return factors


@compiled
def cast_ray(blocked: Array, column: float, row: float, end_column: float, end_row: float, reach: float) -> float:
    """Return the distance [cells] from a point to the first blocked cell on the line to another, `reach` if none is.

    Between cell centres along Bresenham's line; the cell it starts in does not block it.
    """
    height, width = blocked.shape
    x, y = start_x, start_y = int(math.floor(column)), int(math.floor(row))
    span_x, span_y = int(math.floor(end_column)) - x, int(math.floor(end_row)) - y
    step_x, step_y = (1 if span_x > 0 else -1), (1 if span_y > 0 else -1)
    span_x, span_y = abs(span_x), abs(span_y)
    is_steep = span_y > span_x
    longer, shorter = (span_y, span_x) if is_steep else (span_x, span_y)
    error = 0
    for _ in range(longer + 1):  # upstream checks one cell past the end
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


def laser_model(params: AmclParams, grid: OccupancyGrid) -> SensorModel:
    """Return the model of laser_model_type for a map."""
    return (BeamModel if params.laser_model_type == 'beam' else LikelihoodField)(params, grid)
