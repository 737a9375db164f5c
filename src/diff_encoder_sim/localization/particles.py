"""Particle sets: how they are drawn, how far they are spread, and which input is refused.

A set is an array (n, 3) of base poses in the map, x [m], y [m], yaw [rad] in [-pi, pi), with
weights (n,) that sum to 1.
"""

from __future__ import annotations

import math
from statistics import NormalDist

import numpy as np

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D, wrap_angles
from diff_encoder_sim.localization.free_cells import FreeCells
from diff_encoder_sim.localization.kld_resampling import GOLDEN_SECTION
from diff_encoder_sim.localization.occupancy_grid import FREE, OccupancyGrid

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
    """Draw (count, 3) standard normal numbers, spread evenly: their mean is nearer to 0 than that of independent ones.

    A Kronecker sequence (Niederreiter, 1992) from a random place, through the inverse of the normal distribution. Along
    a hallway, where a scan says little, an error of the first particles' mean stays for tens of metres.
    """
    places = np.maximum((rng.random(3) + np.outer(np.arange(count), EVEN_STEPS)) % 1.0, LEAST_CHANCE)
    return np.array([*map(NormalDist().inv_cdf, places.ravel().tolist())]).reshape(count, 3)


def particles_everywhere(free_cells: FreeCells, count: int, rng: np.random.Generator) -> np.ndarray:
    """Draw (count, 3) particles, uniform over the free cells and over all headings."""
    particles = np.empty((count, 3))
    particles[:, :2] = free_cells.centres(rng.integers(0, len(free_cells), count))
    particles[:, 2] = rng.uniform(-np.pi, np.pi, count)
    return particles


def has_converged(particles: np.ndarray) -> bool:
    """Return whether all particles (n, 3) lie close to their unweighted mean."""
    positions = particles[:, :2]
    return bool((np.abs(positions - positions.mean(axis=0)) <= CONVERGED_WITHIN_M).all())


def weight_near(particles: np.ndarray, weights: np.ndarray, pose: Pose2D, within_m: float) -> float:
    """Return the weight, 0 to 1, of the particles (n, 3) this close to a pose along x and y."""
    offsets_m = np.abs(particles[:, :2] - (pose.x_m, pose.y_m))
    return float(weights[(offsets_m <= within_m).all(axis=1)].sum())


def check_grid(grid: OccupancyGrid) -> None:
    """Refuse a map on which no robot can be located.

    Raises:
        InputFault: no cells, no free cell, or an invalid resolution or origin.
    """
    resolution_m = grid.resolution_m
    if grid.cells.ndim != 2 or grid.cells.size == 0:
        raise InputFault(f'map: given {" x ".join(map(str, grid.cells.shape))} cells; allowed: at least 1 x 1')
    if not SMALLEST_CELL_M <= resolution_m <= LARGEST_CELL_M:
        allowed = f'{SMALLEST_CELL_M:g} to {LARGEST_CELL_M:g} m'
        raise InputFault(f'map: given a resolution of {resolution_m} m; allowed: {allowed}')
    check_pose(grid.origin, 'map origin')
    if not (grid.cells == FREE).any():
        raise InputFault('map: no cell is free; expected free space around the robot')


def check_pose(pose: Pose2D, name: str) -> None:
    """Refuse an invalid pose; `name` names it in the error.

    Raises:
        InputFault: a coordinate is not finite or absurdly large.
    """
    if not (
        abs(pose.x_m) <= LARGEST_COORDINATE_M and abs(pose.y_m) <= LARGEST_COORDINATE_M and math.isfinite(pose.yaw_rad)
    ):
        raise InputFault(
            f'{name}: given ({pose.x_m}, {pose.y_m}, {pose.yaw_rad}); expected finite x, y [m] and yaw [rad]'
        )


def check_covariance(covariance: np.ndarray) -> None:
    """Refuse an invalid covariance over (x, y, yaw).

    Raises:
        InputFault: not 3x3, not finite, absurdly large, or a variance below zero.
    """
    covariance = np.asarray(covariance, dtype=float)
    if covariance.shape != (3, 3):
        raise InputFault(f'initial covariance: given shape {covariance.shape}; expected (3, 3)')
    if not (np.abs(covariance) <= LARGEST_COORDINATE_M**2).all() or (np.diag(covariance) < 0.0).any():
        raise InputFault(
            f'initial covariance: given {covariance.tolist()}; expected finite numbers and no variance below 0'
        )
