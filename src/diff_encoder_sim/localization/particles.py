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
from diff_encoder_sim.localization.histogram import GOLDEN_SECTION
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
    if params.axle_x:
        axle_in_base, at_axle = Pose2D(params.axle_x, 0.0, 0.0), params.model_copy(update={'axle_x': 0.0})
        ends = previous.compose(axle_in_base), current.compose(axle_in_base)
        axles = move_particles(_moved_ahead(particles, params.axle_x), *ends, at_axle, rng)
        return _moved_ahead(axles, -params.axle_x)
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


def _moved_ahead(poses: np.ndarray, by_m: float) -> np.ndarray:
    """Return (n, 3) poses moved along their own x axes."""
    moved = poses.copy()
    moved[:, 0] += by_m * np.cos(poses[:, 2])
    moved[:, 1] += by_m * np.sin(poses[:, 2])
    return moved


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
