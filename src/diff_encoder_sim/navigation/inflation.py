"""Inflation: cost that falls with the distance from obstacles, on an exact distance transform.

The cost is that of upstream's inflation layer: lethal in an obstacle, inscribed where a robot centred there would
touch it, then decaying exponentially. The distance transform is exact up to the inflation radius and looks no
farther, so that updating a window takes time in proportion to its area.
"""

from __future__ import annotations

import math

import numpy as np

from diff_encoder_sim.base.compiled import compiled
from diff_encoder_sim.navigation.cost_values import INSCRIBED, LETHAL, NO_INFORMATION


def radius_in_cells(radius_m: float, resolution_m: float) -> int:
    """Return the inflation radius in cells, rounded up as upstream does."""
    return max(0, math.ceil(radius_m / resolution_m - 1e-9))


def cost_table(
    resolution_m: float, inscribed_radius_m: float, inflation_radius_m: float, cost_scaling_factor: float
) -> np.ndarray:
    """Return the cost by squared distance to the nearest obstacle in cells^2: (cells^2 + 1,) uint8.

    As costmap_2d's InflationLayer::computeCost: 252 exp(-factor (distance - inscribed radius)).
    """
    cells = radius_in_cells(inflation_radius_m, resolution_m)
    distance_m = np.sqrt(np.arange(cells * cells + 1)) * resolution_m
    decayed = (INSCRIBED - 1) * np.exp(np.minimum(-cost_scaling_factor * (distance_m - inscribed_radius_m), 0.0))
    costs = np.where(distance_m <= inscribed_radius_m, INSCRIBED, np.minimum(decayed, INSCRIBED))
    costs[0] = LETHAL
    return costs.astype(np.uint8)


@compiled
def squared_distances(is_obstacle: np.ndarray, limit: int) -> np.ndarray:
    """Return the squared distances to the nearest obstacle, (rows, columns) float32 in cells^2.

    Exact up to `limit` cells, up to 4000; beyond, some number above limit^2. The first pass counts along columns, the
    second searches the rows. Whole numbers as float32, of which a processor compares eight at once.
    """
    rows, columns = is_obstacle.shape
    away = _distances_along_columns(is_obstacle, limit)
    squared = np.empty((rows, columns), np.float32)
    # Beyond both ends of a row there is nothing near.
    fenced = np.full(columns + 2 * limit, (limit + 1) ** 2, np.float32)
    for row in range(rows):
        nearest = np.float32(limit + 1)
        for column in range(columns):
            nearest = min(nearest, away[row, column])
            squared[row, column] = fenced[limit + column] = away[row, column] * away[row, column]
        if nearest <= limit:
            _search_row(fenced, limit, squared[row])
    return squared


@compiled
def _distances_along_columns(is_obstacle: np.ndarray, limit: int) -> np.ndarray:
    """Return how far the nearest obstacle in the column is, (rows, columns) float32 in cells; limit + 1 beyond."""
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
    return away


@compiled
def _search_row(fenced: np.ndarray, limit: int, squared: np.ndarray) -> None:
    """Lower a row of squared distances (n,) by those along columns, `fenced` by `limit` cells before and after."""
    for offset in range(1, limit + 1):
        aside = np.float32(offset * offset)
        left, right = fenced[limit - offset :], fenced[limit + offset :]
        for column in range(len(squared)):
            squared[column] = min(squared[column], min(left[column], right[column]) + aside)


@compiled
def inflate(
    base: np.ndarray,
    costs: np.ndarray,
    table: np.ndarray,
    limit: int,
    first_row: int,
    last_row: int,
    first_column: int,
    last_column: int,
) -> None:
    """Write the inflated costs of `base` into a window of `costs`, both (rows, columns) uint8.

    `table` is that of `cost_table`, `limit` the inflation radius in cells; rows and columns go from first to before
    last.
    """
    rows, columns = base.shape
    # Obstacles outside the window reach into it from up to a radius away.
    top, left = max(0, first_row - limit), max(0, first_column - limit)
    bottom, right = min(rows, last_row + limit), min(columns, last_column + limit)
    squared = squared_distances(base[top:bottom, left:right] == LETHAL, limit)
    for row in range(first_row, last_row):
        for column in range(first_column, last_column):
            cost = base[row, column]
            distance = np.uintp(squared[row - top, column - left])
            if distance < len(table):
                inflated = table[distance]
                # Inflation enters unknown space only where the robot would touch the obstacle.
                if cost != NO_INFORMATION:
                    cost = max(cost, inflated)
                elif inflated >= INSCRIBED:
                    cost = inflated
            costs[row, column] = cost
