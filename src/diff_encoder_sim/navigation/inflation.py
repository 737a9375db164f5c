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
    """Return the squared distances to the nearest obstacle, (rows, columns) int32 in cells^2.

    Exact up to `limit` cells; beyond, some number above limit^2. The first pass counts along columns, the second
    searches each row.
    """
    rows, columns = is_obstacle.shape
    along_column = np.empty((rows, columns), np.int32)
    for column in range(columns):
        along_column[0, column] = 0 if is_obstacle[0, column] else limit + 1
    for row in range(1, rows):
        for column in range(columns):
            along_column[row, column] = (
                0 if is_obstacle[row, column] else min(along_column[row - 1, column] + 1, limit + 1)
            )
    for row in range(rows - 2, -1, -1):
        for column in range(columns):
            along_column[row, column] = min(along_column[row, column], along_column[row + 1, column] + 1)
    squared = np.empty((rows, columns), np.int32)
    for row in range(rows):
        _nearest_in_row(along_column[row], limit, squared[row])
    return squared


@compiled
def _nearest_in_row(along_column: np.ndarray, limit: int, squared: np.ndarray) -> None:
    """Fill one row of squared distances from the distances along columns."""
    columns = len(along_column)
    near = np.empty(columns, np.int32)  # cells to the nearest column with an obstacle within the limit
    count = limit + 1
    for column in range(columns):
        count = 0 if along_column[column] <= limit else min(count + 1, limit + 1)
        near[column] = count
    count = limit + 1
    for column in range(columns - 1, -1, -1):
        count = 0 if along_column[column] <= limit else min(count + 1, limit + 1)
        near[column] = min(near[column], count)
    for column in range(columns):
        best = along_column[column] * along_column[column]
        # No column nearer than that has an obstacle: far from obstacles the loop ends at once.
        offset = max(1, near[column])
        while offset <= limit and offset * offset < best:
            if column >= offset:
                left = along_column[column - offset]
                best = min(best, left * left + offset * offset)
            if column + offset < columns:
                right = along_column[column + offset]
                best = min(best, right * right + offset * offset)
            offset += 1
        squared[column] = best


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
            distance = squared[row - top, column - left]
            if distance < len(table):
                inflated = table[distance]
                # Inflation enters unknown space only where the robot would touch the obstacle.
                if cost != NO_INFORMATION:
                    cost = max(cost, inflated)
                elif inflated >= INSCRIBED:
                    cost = inflated
            costs[row, column] = cost
