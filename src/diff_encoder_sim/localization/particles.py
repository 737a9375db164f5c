"""Particle sets: how they are sampled, moved, resampled and clustered, and which input is refused.

A set is an array (n, 3) of base poses in the map, x [m], y [m], yaw [rad] in [-pi, pi), with weights (n,) of sum 1.
KLD-sampling and clustering use a histogram with bins of 0.5 m x 0.5 m x 10 degrees, the keys of an open-addressing hash
table (upstream: a kd-tree). Bins on both sides of +-180 degrees are neighbours; upstream's are a full turn apart.
"""

from __future__ import annotations

import math
from statistics import NormalDist
from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.kernels import Array, compiled
from diff_encoder_sim.base.se2 import Pose2D, wrap_angle, wrap_angles
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.occupancy_grid import FREE, FreeCells, OccupancyGrid

GOLDEN_SECTION = (math.sqrt(5.0) - 1.0) / 2.0

SMALL_TRANSLATION_M = 0.01  # below it the direction between two poses is noise (a turn on the spot): upstream's


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

    Upstream's default model `diff`, on which users have tuned their alphas, takes variances for standard deviations.
    """
    # Relative to forward or reverse, whichever is closer: both are equally noisy.
    turns_rad = move.rotation1_rad, move.rotation2_rad
    turn1, turn2 = (min(abs(wrap_angle(turn)), abs(wrap_angle(turn - math.pi))) ** 2 for turn in turns_rad)
    drive = move.translation_m**2
    by_drive = params.odom_alpha2 * drive
    driven = params.odom_alpha3 * drive + params.odom_alpha4 * (turn1 + turn2)
    variances = Move(params.odom_alpha1 * turn1 + by_drive, driven, params.odom_alpha1 * turn2 + by_drive)
    return Move(*map(math.sqrt, variances)) if params.odom_model_type == 'diff-corrected' else variances


def move_particles(
    particles: np.ndarray, previous: Pose2D, current: Pose2D, params: AmclParams, rng: np.random.Generator
) -> np.ndarray:
    """Move each particle (n, 3) by its own noisy copy of odometry's move between two base poses in odom (table 5.6).

    The axle is moved: a base off it moves sideways in turns, to table 5.6 a noisy turn, drive and turn back.
    """
    if params.axle_x:
        axle_in_base, at_axle = Pose2D(params.axle_x, 0.0, 0.0), params.model_copy(update={'axle_x': 0.0})
        ends = previous.compose(axle_in_base), current.compose(axle_in_base)
        axles = move_particles(_moved_ahead(particles, params.axle_x), *ends, at_axle, rng)
        return _moved_ahead(axles, -params.axle_x)
    move = decompose(previous, current)
    # As many numbers for any move, so that equal seeds stay in step.
    normals, sigmas = rng.standard_normal(particles.shape), move_noise(move, params)
    noisy = (part - sigma * normal for part, sigma, normal in zip(move, sigmas, normals.T))
    rotation1_rad, translation_m, rotation2_rad = noisy
    yaws_rad = particles[:, 2] + rotation1_rad
    x_m, y_m = translation_m * np.cos(yaws_rad), translation_m * np.sin(yaws_rad)
    return np.column_stack([particles[:, 0] + x_m, particles[:, 1] + y_m, wrap_angles(yaws_rad + rotation2_rad)])


def _moved_ahead(poses: np.ndarray, by_m: float) -> np.ndarray:
    """Return (n, 3) poses moved along their own x axes."""
    moved = poses.copy()
    moved[:, 0] += by_m * np.cos(poses[:, 2])
    moved[:, 1] += by_m * np.sin(poses[:, 2])
    return moved


LARGEST_COORDINATE_M = 1e6  # larger ones would not fit the histogram's keys
SMALLEST_CELL_M, LARGEST_CELL_M = 1e-3, 100.0  # side of a map's cells

# Steps of the first particles' places in x, y and yaw: the golden section and roots, which no whole numbers relate.
EVEN_STEPS = (GOLDEN_SECTION, math.sqrt(2.0), math.sqrt(3.0))
LEAST_CHANCE = 1e-12  # 0 has no normal quantile


def particles_around(pose: Pose2D, covariance: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Sample (count, 3) particles from a Gaussian around `pose` (base in the map); raise InputFault for bad input.

    The x, y and yaw-yaw entries of the 3x3 `covariance` count, as upstream reads /initialpose.
    """
    check_pose(pose, 'initial pose')
    check_covariance(covariance)
    variances, axes = np.linalg.eigh(np.asarray(covariance, dtype=float)[:2, :2])
    sigmas, normals, particles = np.sqrt(np.maximum(variances, 0.0)), even_normals(count, rng), np.empty((count, 3))
    for row, (first, second) in enumerate(axes * sigmas):
        particles[:, row] = pose[row] + first * normals[:, 0] + second * normals[:, 1]
    particles[:, 2] = wrap_angles(pose.yaw_rad + np.sqrt(covariance[2][2]) * normals[:, 2])
    return particles


def even_normals(count: int, rng: np.random.Generator) -> np.ndarray:
    """Sample (count, 3) evenly spread standard normal numbers, with a mean closer to 0 than independent samples.

    A Kronecker sequence (Niederreiter, 1992) with a random offset, through the inverse of the normal distribution.
    Scans in a hallway contain little information: an error of the initial mean persists for tens of metres.
    """
    places = np.maximum((rng.random(3) + np.outer(np.arange(count), EVEN_STEPS)) % 1.0, LEAST_CHANCE)
    return np.array([*map(NormalDist().inv_cdf, places.ravel().tolist())]).reshape(count, 3)


def check_grid(grid: OccupancyGrid) -> None:
    """Raise InputFault for a map without a free cell, or with an invalid resolution or origin."""
    if not SMALLEST_CELL_M <= grid.resolution_m <= LARGEST_CELL_M:
        allowed = f'{SMALLEST_CELL_M:g} to {LARGEST_CELL_M:g} m'
        raise InputFault(f'map: given a resolution of {grid.resolution_m} m; allowed: {allowed}')
    check_pose(grid.origin, 'map origin')
    if not (grid.cells == FREE).any():
        raise InputFault('map: no cell is free; expected free space around the robot')


def check_pose(pose: Pose2D, name: str) -> None:
    """Raise InputFault, with `name`, for a pose that is not finite or too large."""
    x_m, y_m, yaw_rad = pose
    if not (max(abs(x_m), abs(y_m)) <= LARGEST_COORDINATE_M and math.isfinite(sum(pose))):
        raise InputFault(f'{name}: given ({x_m}, {y_m}, {yaw_rad}); expected finite x, y [m] and yaw [rad]')


def check_covariance(covariance: np.ndarray) -> None:
    """Raise InputFault for a 3x3 covariance over (x, y, yaw) that is not finite or too large, or a variance below 0."""
    covariance = np.asarray(covariance, dtype=float)
    if not (np.abs(covariance) <= LARGEST_COORDINATE_M**2).all() or (np.diag(covariance) < 0.0).any():
        given = covariance.tolist()
        raise InputFault(f'initial covariance: given {given}; expected finite numbers and no variance below 0')


BIN_M, BINS_PER_TURN = 0.5, 36

# A key is x, y and heading bin: 28, 28 and 6 bits. Coordinates within 1e6 m fit.
_EMPTY, _OFFSET, _MASK, _YAW_BITS = -1, 1 << 27, (1 << 28) - 1, 6


@compiled
def draw_until_enough(
    particles: Array, sums: Array, limits: Array, fraction: float, centres: Array, places: Array, anywhere: Array
) -> np.ndarray:
    """Sample (m, 3) particles one by one until there are enough for the bins that they fill; see `resample`.

    `sums` (n,) are running ones of the weights, `places` (most,) those of the samples among them, of [0, 1).
    `anywhere` (most, 3) are chances, whether a particle is from one of `centres` (most, 2) instead, which, and heading.
    """
    drawn, table = np.empty((len(places), 3)), _new_table(len(places))
    bin_count = count = 0
    while count < len(places) and count <= limits[bin_count]:
        if fraction > 0.0 and anywhere[count, 0] < fraction:
            drawn[count, 0], drawn[count, 1] = centres[count, 0], centres[count, 1]
            drawn[count, 2] = (2.0 * anywhere[count, 2] - 1.0) * math.pi
        else:
            chosen = np.searchsorted(sums, places[count] * sums[-1], side='right')
            if chosen == len(sums):  # rounded to the very end: the last particle that has any weight
                chosen = np.searchsorted(sums, sums[-1], side='left')
            drawn[count] = particles[chosen]
        key = _key_of_pose(drawn[count])
        slot = _slot_of(table, key)
        bin_count += table[slot] != key
        table[slot] = key
        count += 1
    return drawn[:count].copy()


@compiled
def cluster_labels(particles: Array) -> np.ndarray:
    """Return (n,) int64 the cluster of each particle (n, 3), numbered from 0 as they are met."""
    count = len(particles)
    table, slots = _new_table(count), np.empty(count, dtype=np.int64)
    for i in range(count):
        key = _key_of_pose(particles[i])
        slots[i] = _slot_of(table, key)
        table[slots[i]] = key
    label_of_slot = np.full(len(table), -1, dtype=np.int64)
    labels, pending = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    cluster_count = 0
    for i in range(count):
        if label_of_slot[slots[i]] < 0:
            # Bins are connected across corners, too.
            label_of_slot[slots[i]], pending[0], pending_count = cluster_count, slots[i], 1
            while pending_count > 0:
                pending_count -= 1
                key = table[pending[pending_count]]
                x, y, yaw = key >> (28 + _YAW_BITS), (key >> _YAW_BITS) & _MASK, key & ((1 << _YAW_BITS) - 1)
                for step in range(27):
                    near_key = _key_of_bin(x + step // 9 - 1, y + step // 3 % 3 - 1, yaw + step % 3 - 1)
                    near = _slot_of(table, near_key)
                    if table[near] == near_key and label_of_slot[near] < 0:
                        label_of_slot[near], pending[pending_count] = cluster_count, near
                        pending_count += 1
            cluster_count += 1
        labels[i] = label_of_slot[slots[i]]
    return labels


@compiled
def _new_table(largest_count: int) -> np.ndarray:
    """Return an empty table for up to `largest_count` bins, at most half full."""
    size = 16
    while size < 2 * largest_count:
        size *= 2
    return np.full(size, _EMPTY, dtype=np.int64)


@compiled
def _key_of_pose(pose: Array) -> int:
    """Return the key of the bin that holds a pose (3,)."""
    return _key_of_bin(
        int(math.floor(pose[0] / BIN_M)) + _OFFSET,
        int(math.floor(pose[1] / BIN_M)) + _OFFSET,
        int(math.floor(pose[2] * (BINS_PER_TURN / (2.0 * math.pi)))),
    )


@compiled
def _key_of_bin(bin_x: int, bin_y: int, bin_yaw: int) -> int:
    """Return the key of a bin by its indices, x and y from 0; the heading's may be any whole number."""
    return ((bin_x & _MASK) << 28 | (bin_y & _MASK)) << _YAW_BITS | bin_yaw % BINS_PER_TURN


@compiled
def _slot_of(table: Array, key: int) -> int:
    """Return the slot of `key` in the table, or the empty slot for it."""
    mask = len(table) - 1
    # Fibonacci hashing: the high bits of the product depend on all bits of the key.
    slot = ((key * 0x9E3779B97F4A7C1) >> 20) & mask
    while table[slot] != _EMPTY and table[slot] != key:
        slot = (slot + 1) & mask
    return slot


def particle_statistics(particles: np.ndarray, weights: np.ndarray) -> Tuple[Pose2D, np.ndarray]:
    """Return the mean of the heaviest cluster of particles (n, 3) with weights (n,), and the 3x3 covariance of all."""
    labels = cluster_labels(particles)
    cluster_weights = np.bincount(labels, weights)
    in_heaviest = labels == np.argmax(cluster_weights)
    mean, covariance = mean_and_covariance(particles[in_heaviest], weights[in_heaviest])
    if len(cluster_weights) > 1:
        covariance = mean_and_covariance(particles, weights)[1]
    return mean, covariance


@compiled
def _mean_unit_vector(particles: Array, weights: Array) -> Tuple[float, float]:
    # A scalar loop: numpy 1.24's cosine of a strided array depends in the last bit on the memory address.
    cos_sum = sin_sum = 0.0
    for index in range(len(weights)):
        cos_sum += weights[index] * math.cos(particles[index, 2])
        sin_sum += weights[index] * math.sin(particles[index, 2])
    return cos_sum, sin_sum


def mean_and_covariance(particles: np.ndarray, weights: np.ndarray) -> Tuple[Pose2D, np.ndarray]:
    """Return the mean and 3x3 covariance of particles (n, 3) with weights (n,) of any sum above 0.

    Yaw by circular statistics, with the variance of a wrapped normal distribution; as upstream without x and y.
    """
    weights = weights / weights.sum()
    x_m, y_m = float((weights * particles[:, 0]).sum()), float((weights * particles[:, 1]).sum())
    off_x, off_y = particles[:, 0] - x_m, particles[:, 1] - y_m
    cos_mean, sin_mean = _mean_unit_vector(particles, weights)
    covariance = np.zeros((3, 3))
    covariance[0, 0] = (weights * off_x * off_x).sum()
    covariance[0, 1] = covariance[1, 0] = (weights * off_x * off_y).sum()
    covariance[1, 1] = (weights * off_y * off_y).sum()
    length = min(max(math.hypot(cos_mean, sin_mean), 1e-12), 1.0)  # of equal headings 1 + 1e-16, of opposite ones 0
    covariance[2, 2] = -2.0 * math.log(length)
    return Pose2D(x_m, y_m, math.atan2(sin_mean, cos_mean)), covariance


def effective_count(weights: np.ndarray) -> float:
    """Return the effective sample size, 1 / sum of squared weights (weights sum to 1)."""
    return 1.0 / float((weights * weights).sum())


def kld_limits(params: AmclParams) -> np.ndarray:
    """Return (max_particles + 1,) particles needed when k bins are filled, by k.

    They keep the divergence from the posterior below kld_err (table 8.4), by the Wilson-Hilferty approximation of the
    chi-square quantile with bins - 1 degrees of freedom. One bin gives no bound: the most particles, as upstream.
    """
    freedom = np.arange(1.0, params.max_particles)
    variance = 2.0 / (9.0 * freedom)
    roots = 1.0 - variance + np.sqrt(variance) * params.kld_z
    counts = np.ceil(freedom / (2.0 * params.kld_err) * roots**3)
    limits = np.full(params.max_particles + 1, params.max_particles)
    limits[2:] = np.clip(counts, params.min_particles, params.max_particles)
    return limits


def resample(
    particles: Array, weights: Array, limits: Array, fraction: float, free_cells: FreeCells, rng: np.random.Generator
) -> np.ndarray:
    """Sample (m, 3) particles of equal weight from a weighted set, m by the limits of `kld_limits`.

    A fraction is sampled from the free cells of the map; `rng` as for the most particles, so that seeds stay in step.
    """
    places = even_places(len(limits) - 1, rng.random())
    anywhere = rng.random((len(places), 3)) if fraction > 0.0 else np.empty((0, 3))
    centres = free_cells.centres((anywhere[:, 1] * len(free_cells)).astype(int))
    return draw_until_enough(particles, np.cumsum(weights), limits, fraction, centres, places, anywhere)


def even_places(count: int, offset: float) -> np.ndarray:
    """Return (count,) evenly spread places of [0, 1) by an offset of [0, 1); the first few are spread nearly as evenly.

    Those of systematic resampling in steps of about the golden section, which divides each gap before one twice.
    """
    step = round(GOLDEN_SECTION * count)
    while math.gcd(step, count) != 1:  # or some places would be visited twice
        step += 1
    return np.asarray((np.arange(count) * step % count + offset) / count)
