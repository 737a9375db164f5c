"""From hits and visits of cells to a map."""

from __future__ import annotations

import numpy as np

from diff_encoder_sim.mapping.occupancy_grid import FREE, OCCUPIED, UNKNOWN

# A cell with less than this share of the hits of a cell beside it is no surface of its own, but
# where noise carried some of that one's rays. Upstream draws it as occupied; with 3 cm of noise
# these are a sixth of its walls' cells, all behind them.
STRAY_SHARE = 0.2


def occupancy(hits: np.ndarray, visits: np.ndarray, occ_thresh: float) -> np.ndarray:
    """(height, width) int8: 0, 100 or -1.

    Args:
        hits: (height, width) rays that ended in a cell.
        visits: (height, width) rays that ended in it or passed it; 0 is unknown.
        occ_thresh: share of the visits that must be hits, more than that, to be occupied.
    """
    is_occupied = hits > occ_thresh * visits
    is_stray = is_occupied & (hits < STRAY_SHARE * _largest_around(hits))
    return np.select([is_stray | (visits == 0.0), is_occupied], [UNKNOWN, OCCUPIED], FREE).astype(np.int8)


def _largest_around(values: np.ndarray) -> np.ndarray:
    """The largest value in the 3 x 3 cells about each."""
    padded = np.pad(values, 1)
    rows = np.maximum(np.maximum(padded[:-2], padded[1:-1]), padded[2:])
    return np.maximum(np.maximum(rows[:, :-2], rows[:, 1:-1]), rows[:, 2:])
