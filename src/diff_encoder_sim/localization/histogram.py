"""The histogram over poses, bins of 0.5 m x 0.5 m x 10 degrees: KLD-sampling and clustering use it.

Upstream keeps the bins in a kd-tree; here they are the keys of an open-addressing hash table, an
int64 array whose length is a power of two. Headings wrap: bins on both sides of +-180 degrees are
neighbours, where upstream's are a full turn apart.

All its kernels are in this file: numba's cache on disk does not notice when a kernel in another
file, which one calls, has changed.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.kernels import Array, compiled
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.occupancy_grid import FreeCells

BIN_M = 0.5
BINS_PER_TURN = 36

_EMPTY = -1
# A key is x, y and heading bin: 28, 28 and 6 bits. Coordinates within 1e6 m fit.
_OFFSET = 1 << 27
_MASK = (1 << 28) - 1
_YAW_BITS = 6


@compiled
def draw_until_enough(
    particles: Array,
    cumulative: Array,
    limits: Array,
    fraction_anywhere: float,
    centres: Array,
    places: Array,
    anywhere: Array,
) -> np.ndarray:
    """Draw (m, 3) particles one by one until there are enough for the bins that they fill.

    Args:
        particles: (n, 3) x [m], y [m], yaw [rad].
        cumulative: (n,) running sums of their weights.
        limits: (most + 1,) how many are enough, by the number of bins.
        fraction_anywhere: probability that a particle is drawn from all cells instead.
        centres: (most, 2) x, y [m] of the cell that each is then drawn from.
        places: (most,) which particle: its place among the weights, of [0, 1).
        anywhere: (most, 3) chances: whether it is drawn from all cells, which cell, which heading.
    """
    drawn = np.empty((len(places), 3))
    table = _new_table(len(places))
    bin_count = count = 0
    while count < len(places) and count <= limits[bin_count]:
        if fraction_anywhere > 0.0 and anywhere[count, 0] < fraction_anywhere:
            drawn[count, 0], drawn[count, 1] = centres[count, 0], centres[count, 1]
            drawn[count, 2] = (2.0 * anywhere[count, 2] - 1.0) * math.pi
        else:
            target = places[count] * cumulative[-1]
            chosen = np.searchsorted(cumulative, target, side='right')
            # Rounding may put the target on the very end: the last particle that has any weight.
            if chosen == len(cumulative):
                chosen = np.searchsorted(cumulative, cumulative[-1], side='left')
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
    table = _new_table(count)
    slots = np.empty(count, dtype=np.int64)
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


class ParticleStatistics(NamedTuple):
    """Mean, spread and clusters of a particle set, in the map frame."""

    mean: Pose2D  # of the heaviest cluster
    covariance: np.ndarray  # 3x3 over (x [m], y [m], yaw [rad]), of all particles
    cluster_weight: float  # the heaviest cluster's fraction of the weight, 0 to 1
    cluster_count: int


def particle_statistics(particles: np.ndarray, weights: np.ndarray) -> ParticleStatistics:
    """Cluster particles (n, 3) with weights (n,), sum 1."""
    labels = cluster_labels(particles)
    cluster_weights = np.bincount(labels, weights)
    heaviest = int(np.argmax(cluster_weights))
    in_heaviest = labels == heaviest
    mean, covariance = mean_and_covariance(particles[in_heaviest], weights[in_heaviest])
    if len(cluster_weights) > 1:
        covariance = mean_and_covariance(particles, weights)[1]
    return ParticleStatistics(mean, covariance, float(cluster_weights[heaviest]), len(cluster_weights))


@compiled
def _mean_unit_vector(particles: Array, weights: Array) -> Tuple[float, float]:
    """Return the mean of (cos yaw, sin yaw) with weights of sum 1.

    A scalar loop: numpy 1.24's cosine of a strided array differed in the last bit between runs,
    depending on the memory address.
    """
    cos_sum, sin_sum = 0.0, 0.0
    for index in range(len(weights)):
        cos_sum += weights[index] * math.cos(particles[index, 2])
        sin_sum += weights[index] * math.sin(particles[index, 2])
    return cos_sum, sin_sum


def mean_and_covariance(particles: np.ndarray, weights: np.ndarray) -> Tuple[Pose2D, np.ndarray]:
    """Return the mean and 3x3 covariance of particles (n, 3) with weights (n,) of any sum above 0.

    Yaw by circular statistics: the direction of the mean unit vector, and -2 ln of its length,
    which is the variance of a wrapped normal distribution. As upstream publishes it, nothing between yaw and x or y.
    """
    weights = weights / weights.sum()
    x_m, y_m = float((weights * particles[:, 0]).sum()), float((weights * particles[:, 1]).sum())
    off_x, off_y = particles[:, 0] - x_m, particles[:, 1] - y_m
    cos_mean, sin_mean = _mean_unit_vector(particles, weights)
    covariance = np.zeros((3, 3))
    covariance[0, 0] = (weights * off_x * off_x).sum()
    covariance[0, 1] = covariance[1, 0] = (weights * off_x * off_y).sum()
    covariance[1, 1] = (weights * off_y * off_y).sum()
    # Equal headings may give a length of 1 + 1e-16, opposite ones 0: neither has a logarithm that
    # could be published.
    length = min(max(math.hypot(cos_mean, sin_mean), 1e-12), 1.0)
    covariance[2, 2] = -2.0 * math.log(length)
    return Pose2D(x_m, y_m, math.atan2(sin_mean, cos_mean)), covariance


GOLDEN_SECTION = (math.sqrt(5.0) - 1.0) / 2.0


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
