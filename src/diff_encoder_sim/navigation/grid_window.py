"""A rectangle of a grid's cells."""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

from diff_encoder_sim.base.se2 import Pose2D


class GridWindow(NamedTuple):
    """Cells from first to before last."""

    first_row: int
    last_row: int
    first_column: int
    last_column: int

    @property
    def is_empty(self) -> bool:
        """Whether there is no cell in it."""
        return self.first_row >= self.last_row or self.first_column >= self.last_column

    @property
    def cells(self) -> Tuple[slice, slice]:
        """To index an array with."""
        return slice(self.first_row, self.last_row), slice(self.first_column, self.last_column)

    def with_margin(self, cells: int, shape: Tuple[int, int]) -> GridWindow:
        """Wider on all sides, as far as a grid of (rows, columns) goes."""
        rows, columns = shape
        return GridWindow(
            max(0, self.first_row - cells),
            min(rows, self.last_row + cells),
            max(0, self.first_column - cells),
            min(columns, self.last_column + cells),
        )

    def around_both(self, other: GridWindow) -> GridWindow:
        """The smallest that holds two, neither of them empty."""
        return GridWindow(
            min(self.first_row, other.first_row),
            max(self.last_row, other.last_row),
            min(self.first_column, other.first_column),
            max(self.last_column, other.last_column),
        )


def window_around(place: Pose2D, reach_m: float, per_m: float, shape: Tuple[int, int]) -> GridWindow:
    """The cells of a grid (rows, columns), `per_m` in a metre, up to `reach_m` from a place."""
    bounds = []
    for centre_m, size in ((place.y_m, shape[0]), (place.x_m, shape[1])):
        bounds += [
            min(max(0, math.floor((centre_m - reach_m) * per_m)), size),
            min(max(0, math.floor((centre_m + reach_m) * per_m) + 1), size),
        ]
    return GridWindow(*bounds)
