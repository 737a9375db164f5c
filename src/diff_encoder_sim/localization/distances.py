"""Distances from the cells of a grid to the nearest occupied one: of a costmap's inflation, and of laser models."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from diff_encoder_sim.base.kernels import Array, compiled


class DistanceField(NamedTuple):
    """The distance from each cell's centre to that of the nearest occupied one.

    There are few different ones: what depends only on the distance is computed for these, and looked up for each cell.
    """

    indices: np.ndarray  # (height, width) int32, of `distances_m`
    distances_m: np.ndarray  # (n,), rising; the last one is the largest that is distinguished


def distance_field(occupied: np.ndarray, resolution_m: float, max_distance_m: float) -> DistanceField:
    """Return the distances from all cells.

    Args:
        occupied: (height, width) bool.
        resolution_m: side of a cell.
        max_distance_m: the value of cells that are farther than this from any occupied one.
    """
    height, width = occupied.shape
    # Squared, in cells. Larger ones are beyond the limit, or on no grid of this size.
    limit = math.ceil(max_distance_m / resolution_m)
    most = min(limit**2, height**2 + width**2)
    distances_m = np.minimum(np.sqrt(np.arange(most + 1)) * resolution_m, max_distance_m)
    distances_m[most] = max_distance_m
    squared = squared_distances(np.ascontiguousarray(occupied, dtype=np.bool_), min(limit, height + width))
    return DistanceField(np.minimum(squared, most).astype(np.int32), distances_m)


@compiled
def squared_distances(is_obstacle: Array, limit: int) -> np.ndarray:
    """Return the squared distances to the nearest obstacle, (rows, columns) float32 in cells^2.

    Exact up to `limit` cells, up to 4000; beyond, some number above limit^2. The first pass counts along columns, down
    and up, the second searches the rows. Whole numbers as float32, of which a processor compares eight at once.
    """
    rows, columns = is_obstacle.shape
    none, one, most = np.float32(0.0), np.float32(1.0), np.float32(limit + 1)
    away = np.empty((rows, columns), np.float32)
    for column in range(columns):
        away[0, column] = none if is_obstacle[0, column] else most
    for row in range(1, rows):
        for column in range(columns):
            away[row, column] = none if is_obstacle[row, column] else min(away[row - 1, column] + one, most)
    for row in range(rows - 2, -1, -1):
        for column in range(columns):
            away[row, column] = min(away[row, column], away[row + 1, column] + one)
    squared = np.empty((rows, columns), np.float32)
    # Beyond both ends of a row there is nothing near.
    fenced = np.full(columns + 2 * limit, (limit + 1) ** 2, np.float32)
    for row in range(rows):
        nearest = most
        for column in range(columns):
            nearest = min(nearest, away[row, column])
            squared[row, column] = fenced[limit + column] = away[row, column] * away[row, column]
        if nearest <= limit:
            _search_row(fenced, limit, squared[row])
    return squared


@compiled
def _search_row(fenced: Array, limit: int, squared: Array) -> None:
    """Lower a row of squared distances (n,) by those along columns, `fenced` by `limit` cells before and after."""
    for offset in range(1, limit + 1):
        aside = np.float32(offset * offset)
        left, right = fenced[limit - offset :], fenced[limit + offset :]
        for column in range(len(squared)):
            squared[column] = min(squared[column], min(left[column], right[column]) + aside)
