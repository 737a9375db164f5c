"""The distance from every cell of a grid to the nearest occupied one, exact and in two passes.

Felzenszwalb and Huttenlocher, "Distance Transforms of Sampled Functions", 2012: first along the
columns, then along the rows as the lower envelope of parabolas. Upstream's brushfire visits the
same cells from a queue and is sometimes off by part of a cell.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from diff_encoder_sim.base.compiled import compiled

# Stands for "no occupied cell in this column"; its square still fits an int64 with room to add.
_FAR = 1 << 28


class DistanceField(NamedTuple):
    """The distance from each cell's centre to that of the nearest occupied one.

    There are few different ones: what depends on the distance alone is computed for these, and looked up for each cell.
    """

    indices: np.ndarray  # (height, width) int32, of `distances_m`
    distances_m: np.ndarray  # (n,), rising; the last one is the largest that is told apart


def distance_field(occupied: np.ndarray, resolution_m: float, max_distance_m: float) -> DistanceField:
    """Return the distances from all cells.

    Args:
        occupied: (height, width) bool.
        resolution_m: side of a cell.
        max_distance_m: the value of cells that are farther than this from any occupied one.
    """
    height, width = occupied.shape
    # Squared, in cells. Larger ones are beyond the limit, or on no grid of this size.
    most = min(math.ceil(max_distance_m / resolution_m) ** 2, height**2 + width**2)
    distances_m = np.minimum(np.sqrt(np.arange(most + 1)) * resolution_m, max_distance_m)
    distances_m[most] = max_distance_m
    return DistanceField(_squared_distances(np.ascontiguousarray(occupied, dtype=np.bool_), most), distances_m)


@compiled
def _squared_distances(occupied: np.ndarray, most: int) -> np.ndarray:  # pragma: no cover (compiled)
    """Return (height, width) int32 squared distance in cells, at most `most`."""
    height, width = occupied.shape
    squared = np.empty((height, width), dtype=np.int32)
    _along_columns(occupied, squared)
    in_column = np.empty(width, dtype=np.int64)
    vertices = np.empty(width, dtype=np.int64)
    starts = np.empty(width, dtype=np.int64)
    for row in range(height):
        in_column[:] = squared[row]
        _along_row(in_column, squared[row], vertices, starts, most)
    return squared


@compiled
def _along_columns(occupied: np.ndarray, distance: np.ndarray) -> None:  # pragma: no cover
    """Fill in the distance to the nearest occupied cell of the same column: once down, once up."""
    height, width = occupied.shape
    for column in range(width):
        distance[0, column] = 0 if occupied[0, column] else _FAR
    for row in range(1, height):
        for column in range(width):
            distance[row, column] = 0 if occupied[row, column] else min(distance[row - 1, column] + 1, _FAR)
    for row in range(height - 2, -1, -1):
        for column in range(width):
            distance[row, column] = min(distance[row, column], distance[row + 1, column] + 1)


@compiled
def _along_row(
    heights: np.ndarray, squared: np.ndarray, vertices: np.ndarray, starts: np.ndarray, most: int
) -> None:  # pragma: no cover
    """Fill in the lower envelope of the parabolas (x - v)^2 + heights[v]^2, in whole numbers, where it is below `most`.

    `vertices` and `starts` are scratch: the columns whose parabola is on the envelope, and the
    first column at which each is the lowest.
    """
    width = len(heights)
    count = 1
    vertices[0] = starts[0] = 0
    for column in range(1, width):
        crossing = 0
        while count > 0:
            vertex = vertices[count - 1]
            # From the crossing on, the later parabola is lower.
            crossing = (
                column * column
                - vertex * vertex
                + heights[column] * heights[column]
                - heights[vertex] * heights[vertex]
            ) // (2 * (column - vertex)) + 1
            if crossing > starts[count - 1]:
                break
            count -= 1
        if count == 0:
            crossing = 0
        if crossing < width:
            vertices[count] = column
            starts[count] = crossing
            count += 1
    index = 0
    for column in range(width):
        while index + 1 < count and starts[index + 1] <= column:
            index += 1
        offset = column - vertices[index]
        squared[column] = min(offset * offset + heights[vertices[index]] * heights[vertices[index]], most)
