"""Rectangular windows of a grid's cells."""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D


class GridWindow(NamedTuple):
    """Rows and columns of a grid, each from first to before last."""

    first_row: int
    last_row: int
    first_column: int
    last_column: int

    @property
    def is_empty(self) -> bool:
        """Return whether the window has no cells."""
        return self.first_row >= self.last_row or self.first_column >= self.last_column

    @property
    def cells(self) -> Tuple[slice, slice]:
        """Return the index of these cells in an array."""
        return slice(self.first_row, self.last_row), slice(self.first_column, self.last_column)

    def with_margin(self, cells: int, shape: Tuple[int, int]) -> GridWindow:
        """Return the window widened on all sides, clipped to a grid of (rows, columns)."""
        rows = max(0, self.first_row - cells), min(shape[0], self.last_row + cells)
        return GridWindow(*rows, max(0, self.first_column - cells), min(shape[1], self.last_column + cells))

    def around_both(self, other: GridWindow) -> GridWindow:
        """Return the smallest window that holds both; neither may be empty."""
        return GridWindow(
            min(self.first_row, other.first_row),
            max(self.last_row, other.last_row),
            min(self.first_column, other.first_column),
            max(self.last_column, other.last_column),
        )


def window_around(place: Pose2D, reach_m: float, per_m: float, shape: Tuple[int, int]) -> GridWindow:
    """Return the cells within `reach_m` of a place along both axes.

    Args:
        place: in the grid's own frame.
        reach_m: distance [m].
        per_m: cells in a metre.
        shape: (rows, columns) of the grid.
    """
    rows = _cells_around(place.y_m, reach_m, per_m, shape[0])
    return GridWindow(*rows, *_cells_around(place.x_m, reach_m, per_m, shape[1]))


def changed_window(before: np.ndarray, after: np.ndarray) -> GridWindow:
    """Return the smallest window with all cells in which two grids (rows, columns) differ; empty if they are equal."""
    differs = before != after
    rows, columns = np.flatnonzero(differs.any(axis=1)), np.flatnonzero(differs.any(axis=0))
    if len(rows) == 0:
        return GridWindow(0, 0, 0, 0)
    return GridWindow(int(rows[0]), int(rows[-1]) + 1, int(columns[0]), int(columns[-1]) + 1)


def _cells_around(centre_m: float, reach_m: float, per_m: float, size: int) -> Tuple[int, int]:
    """Return the first cell within reach along one axis and the one behind the last."""
    first = min(max(0, math.floor((centre_m - reach_m) * per_m)), size)
    return first, min(max(0, math.floor((centre_m + reach_m) * per_m) + 1), size)
