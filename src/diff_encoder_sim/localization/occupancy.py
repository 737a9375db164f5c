"""The occupancy of cells, from how many rays ended in them and passed them."""

from __future__ import annotations

import numpy as np

from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, UNKNOWN

# A cell with less than this fraction of the hits of a cell beside it is no surface of its own:
# noise carried some of that one's rays into it. Upstream draws it as occupied. Of two cells with a
# wall on their border, both have about half of the hits, and both are occupied: so opposite walls are
# marked alike, and localization on the map is not pulled to one side.
STRAY_FRACTION = 0.3


def occupancy(hits: np.ndarray, visits: np.ndarray, occ_thresh: float) -> np.ndarray:
    """Return (height, width) int8: 0, 100 or -1.

    Args:
        hits: (height, width) rays that ended in a cell.
        visits: (height, width) rays that ended in it or passed it; 0 is unknown.
        occ_thresh: a cell is occupied if more than this fraction of its visits are hits.
    """
    is_occupied = hits > occ_thresh * visits
    is_stray = is_occupied & (hits < STRAY_FRACTION * _largest_around(hits))
    return np.select([is_stray | (visits == 0.0), is_occupied], [UNKNOWN, OCCUPIED], FREE).astype(np.int8)


def _largest_around(values: np.ndarray) -> np.ndarray:
    """Return the largest value in the 3 x 3 cells about each."""
    padded = np.pad(values, 1)
    rows = np.maximum(np.maximum(padded[:-2], padded[1:-1]), padded[2:])
    largest: np.ndarray = np.maximum(np.maximum(rows[:, :-2], rows[:, 1:-1]), rows[:, 2:])
    return largest
