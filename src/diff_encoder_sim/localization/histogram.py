"""The histogram over poses, bins of 0.5 m x 0.5 m x 10 degrees: KLD-sampling and clustering use it.

Upstream keeps the bins in a kd-tree; here they are the keys of an open-addressing hash table, an
int64 array whose length is a power of two. Headings wrap: bins on both sides of +-180 degrees are
neighbours, where upstream's are a full turn apart.

All its kernels are in this file: numba's cache on disk does not notice when a kernel in another
file, which one calls, has changed.
"""

from __future__ import annotations

import math

import numpy as np

from diff_encoder_sim.base.compiled import compiled

BIN_M = 0.5
BINS_PER_TURN = 36

_EMPTY = -1
# A key is x, y and heading bin: 28, 28 and 6 bits. Coordinates within 1e6 m fit.
_OFFSET = 1 << 27
_MASK = (1 << 28) - 1
_YAW_BITS = 6


@compiled
def draw_until_enough(
    particles: np.ndarray,
    cumulative: np.ndarray,
    limits: np.ndarray,
    fraction_anywhere: float,
    centres: np.ndarray,
    places: np.ndarray,
    anywhere: np.ndarray,
) -> np.ndarray:  # pragma: no cover (compiled)
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
    bin_count = 0
    count = 0
    while count < len(places):
        if fraction_anywhere > 0.0 and anywhere[count, 0] < fraction_anywhere:
            drawn[count, 0] = centres[count, 0]
            drawn[count, 1] = centres[count, 1]
            drawn[count, 2] = (2.0 * anywhere[count, 2] - 1.0) * math.pi
        else:
            drawn[count] = particles[_chosen_index(cumulative, places[count])]
        if _add(table, _key_of_pose(drawn[count, 0], drawn[count, 1], drawn[count, 2])):
            bin_count += 1
        count += 1
        if count > limits[bin_count]:
            break
    return drawn[:count].copy()


@compiled
def _chosen_index(cumulative: np.ndarray, place: float) -> int:  # pragma: no cover (compiled)
    """Return the particle whose part of [0, 1) holds `place`; never one of weight 0."""
    target = place * cumulative[-1]
    index = np.searchsorted(cumulative, target, side='right')
    # Rounding may put the target on the very end: the last particle that has any weight.
    if index == len(cumulative):
        index = np.searchsorted(cumulative, cumulative[-1], side='left')
    return int(index)


@compiled
def cluster_labels(particles: np.ndarray) -> np.ndarray:  # pragma: no cover (compiled)
    """Return (n,) int64 the cluster of each particle (n, 3), numbered from 0 as they are met."""
    count = len(particles)
    table = _new_table(count)
    keys = np.empty(count, dtype=np.int64)
    for i in range(count):
        keys[i] = _key_of_pose(particles[i, 0], particles[i, 1], particles[i, 2])
        _add(table, keys[i])
    label_of_slot = np.full(len(table), -1, dtype=np.int64)
    labels = np.empty(count, dtype=np.int64)
    pending = np.empty(count, dtype=np.int64)
    cluster_count = 0
    for i in range(count):
        slot = _slot_of(table, keys[i])
        if label_of_slot[slot] < 0:
            _label_connected(table, slot, cluster_count, label_of_slot, pending)
            cluster_count += 1
        labels[i] = label_of_slot[slot]
    return labels


@compiled
def _label_connected(
    table: np.ndarray, slot: int, label: int, label_of_slot: np.ndarray, pending: np.ndarray
) -> None:  # pragma: no cover (compiled)
    """Give `label` to a bin and to all that are connected with it, across corners too."""
    label_of_slot[slot] = label
    pending[0] = slot
    pending_count = 1
    while pending_count > 0:
        pending_count -= 1
        key = table[pending[pending_count]]
        for step in range(27):
            other_key = _neighbour(key, step // 9 - 1, step // 3 % 3 - 1, step % 3 - 1)
            other = _slot_of(table, other_key)
            if table[other] == other_key and label_of_slot[other] < 0:
                label_of_slot[other] = label
                pending[pending_count] = other
                pending_count += 1


@compiled
def _new_table(largest_count: int) -> np.ndarray:  # pragma: no cover (compiled)
    """Return an empty table for up to `largest_count` bins, at most half full."""
    size = 16
    while size < 2 * largest_count:
        size *= 2
    return np.full(size, _EMPTY, dtype=np.int64)


@compiled
def _key_of_pose(x_m: float, y_m: float, yaw_rad: float) -> int:  # pragma: no cover (compiled)
    """Return the key of the bin that holds a pose."""
    return _key_of_bin(
        int(math.floor(x_m / BIN_M)),
        int(math.floor(y_m / BIN_M)),
        int(math.floor(yaw_rad * (BINS_PER_TURN / (2.0 * math.pi)))),
    )


@compiled
def _key_of_bin(bin_x: int, bin_y: int, bin_yaw: int) -> int:  # pragma: no cover (compiled)
    """Return the key of a bin by its indices; the heading's may be any whole number."""
    return (((bin_x + _OFFSET) & _MASK) << 28 | ((bin_y + _OFFSET) & _MASK)) << _YAW_BITS | bin_yaw % BINS_PER_TURN


@compiled
def _neighbour(key: int, step_x: int, step_y: int, step_yaw: int) -> int:  # pragma: no cover
    """Return the key of the bin so many steps away."""
    return _key_of_bin(
        (key >> (28 + _YAW_BITS)) - _OFFSET + step_x,
        ((key >> _YAW_BITS) & _MASK) - _OFFSET + step_y,
        (key & ((1 << _YAW_BITS) - 1)) + step_yaw,
    )


@compiled
def _slot_of(table: np.ndarray, key: int) -> int:  # pragma: no cover (compiled)
    """Find `key` in the table, or the empty slot where it belongs."""
    mask = len(table) - 1
    # Fibonacci hashing: the high bits of the product depend on all bits of the key.
    slot = ((key * 0x9E3779B97F4A7C1) >> 20) & mask
    while table[slot] != _EMPTY and table[slot] != key:
        slot = (slot + 1) & mask
    return slot


@compiled
def _add(table: np.ndarray, key: int) -> bool:  # pragma: no cover (compiled)
    """Put `key` into the table; return whether it is new."""
    slot = _slot_of(table, key)
    if table[slot] == key:
        return False
    table[slot] = key
    return True
