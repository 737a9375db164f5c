"""Layers of a costmap: obstacles that scans mark and clear, and inflation."""

from __future__ import annotations

import math
from typing import NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.base.kernels import compiled
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.navigation.costmap_params import CostmapParams
from diff_encoder_sim.navigation.footprint import fill_polygon

FREE = 0
INSCRIBED = 253  # the robot touches an obstacle whatever its heading
LETHAL = 254  # an obstacle
NO_INFORMATION = 255  # unknown space


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


# Added before a number is cut off, rounds it, halves down: farther from a half no line of 10^8 cells comes.
ROUNDING = 0.5 - 1e-9


@compiled
def clear_and_mark(
    cells: np.ndarray,
    per_m: float,
    x_m: float,
    y_m: float,
    yaw_rad: float,
    angle_min_rad: float,
    angle_increment_rad: float,
    ranges_m: np.ndarray,
    range_min_m: float,
    range_max_m: float,
    raytrace_range_m: float,
    obstacle_range_m: float,
    inf_is_valid: bool,
    clears: bool,
    marks: bool,
) -> None:
    """Enter one scan into an obstacle layer `cells`, (rows, columns) uint8 with `per_m` cells in a metre.

    All rays clear before any marks, so that a ray that grazes an obstacle does not erase another ray's hit. x_m,
    y_m, yaw_rad is the laser in the grid's own frame. A range that is NaN or outside range_min to range_max is
    ignored; +inf clears up to raytrace_range if `inf_is_valid`.
    """
    rows, columns = cells.shape
    row, column = math.floor(y_m * per_m), math.floor(x_m * per_m)
    clears = clears and 0 <= row < rows and 0 <= column < columns
    hits, hit_count = np.empty((len(ranges_m), 2), np.int64), 0
    last_row, last_column, last_is_longer = row, column, False
    for index in range(len(ranges_m)):
        range_m = ranges_m[index]
        is_valid = inf_is_valid if range_m == math.inf else range_min_m <= range_m <= range_max_m
        if not is_valid:
            continue
        bearing_rad = yaw_rad + angle_min_rad + index * angle_increment_rad
        sin_bearing, cos_bearing = math.sin(bearing_rad), math.cos(bearing_rad)
        if clears:
            reach_m = min(range_m, raytrace_range_m)
            to_row = math.floor((y_m + reach_m * sin_bearing) * per_m)
            to_column = math.floor((x_m + reach_m * cos_bearing) * per_m)
            is_longer = range_m > raytrace_range_m
            # Neighbouring rays that end in the same cell pass the same cells.
            if to_row != last_row or to_column != last_column or is_longer != last_is_longer:
                _clear_ray(cells, row, column, to_row, to_column, is_longer)
                last_row, last_column, last_is_longer = to_row, to_column, is_longer
        if range_m <= obstacle_range_m and range_m < math.inf:
            hits[hit_count, 0] = math.floor((y_m + range_m * sin_bearing) * per_m)
            hits[hit_count, 1] = math.floor((x_m + range_m * cos_bearing) * per_m)
            hit_count += 1
    if marks:
        _mark(cells, hits[:hit_count])


@compiled
def _mark(cells: np.ndarray, hits: np.ndarray) -> None:
    """Mark the cells of `hits`, (n, 2) row and column, that are on the grid."""
    for index in range(len(hits)):
        row, column = hits[index]
        if 0 <= row < cells.shape[0] and 0 <= column < cells.shape[1]:
            cells[row, column] = LETHAL


@compiled
def clear_outline(cells: np.ndarray, per_m: float, corners_m: np.ndarray) -> None:
    """Clear the cells that the sides of a polygon (n, 2) cross, given in the grid's own frame.

    Their centres may lie outside the polygon, but they count in the cost of the robot's footprint.
    """
    row, column = math.floor(corners_m[-1, 1] * per_m), math.floor(corners_m[-1, 0] * per_m)
    for index in range(len(corners_m)):
        to_row = math.floor(corners_m[index, 1] * per_m)
        to_column = math.floor(corners_m[index, 0] * per_m)
        _clear_ray(cells, row, column, to_row, to_column, True)
        row, column = to_row, to_column


@compiled
def _clear_ray(cells: np.ndarray, row: int, column: int, to_row: int, to_column: int, with_end: bool) -> None:
    """Clear the cells of a line (Bresenham) up to its end or the edge of the grid.

    In closed form, of which a processor computes several steps at once: the n-th cell of a line of `right` columns and
    fewer rows, `down`, is n down / right rows away, rounded, halves down.
    """
    rows, columns = cells.shape
    if not (0 <= row < rows and 0 <= column < columns):
        return
    down, right = abs(to_row - row), abs(to_column - column)
    row_step = 1 if to_row > row else -1
    column_step = 1 if to_column > column else -1
    rows_left = rows - 1 - row if row_step > 0 else row
    columns_left = columns - 1 - column if column_step > 0 else column
    # The cell of the hit itself stays as it was: the ray has not passed through it.
    count = max(down, right) + with_end
    if right >= down:
        count = min(count, columns_left + 1, _count_within(rows_left, down, right))
        slope = down / max(right, 1)
        for n in range(count):
            cells[np.uintp(row + row_step * int(n * slope + ROUNDING)), np.uintp(column + column_step * n)] = FREE
    else:
        count = min(count, rows_left + 1, _count_within(columns_left, right, down))
        slope = right / down
        for n in range(count):
            cells[np.uintp(row + row_step * n), np.uintp(column + column_step * int(n * slope + ROUNDING))] = FREE


@compiled
def _count_within(cells_left: int, across: int, along: int) -> int:
    """Return how many cells of a line that goes `across` while it goes `along` are no more than `cells_left` across."""
    if across <= cells_left:
        return along + 1
    return (2 * cells_left + 1) * along // (2 * across) + 1


class ObstacleLayer:
    """Cells of a costmap that hold obstacles, free space or `unseen`; places are in the grid's own frame.

    Args:
        params: the costmap's.
        shape: (rows, columns) of the costmap.
        per_m: cells in a metre.
        unseen: cost of cells where no ray has been.
    """

    def __init__(self, params: CostmapParams, shape: Tuple[int, int], per_m: float, unseen: int) -> None:
        self.cells = np.full(shape, unseen, np.uint8)
        self._params, self._per_m, self._unseen = params, per_m, unseen

    def enter(self, scan: Scan, laser: Pose2D) -> None:
        """Clear and mark by a scan taken at `laser`."""
        params, source = self._params, self._params.scan
        if not params.observation_sources:
            return
        clear_and_mark(
            self.cells,
            self._per_m,
            laser.x_m,
            laser.y_m,
            laser.yaw_rad,
            scan.angle_min_rad,
            scan.angle_increment_rad,
            np.asarray(scan.ranges_m, dtype=np.float64),
            scan.range_min_m,
            scan.range_max_m,
            params.raytrace_range,
            params.obstacle_range,
            source.inf_is_valid,
            source.clearing,
            source.marking,
        )

    def clear_polygon(self, corners_m: np.ndarray) -> None:
        """Clear the cells inside a polygon (n, 2) and those that its sides cross."""
        fill_polygon(self.cells, self._per_m, corners_m, FREE)
        clear_outline(self.cells, self._per_m, corners_m)

    def forget(self, kept: Optional[GridWindow] = None) -> None:
        """Make all cells unseen, except those of a window."""
        cells = np.full_like(self.cells, self._unseen)
        if kept is not None:
            cells[kept.cells] = self.cells[kept.cells]
        self.cells = cells

    def shift(self, down: int, right: int) -> None:
        """Move the grid by whole rows and columns over the world, keeping the cells in sight."""
        rows, columns = self.cells.shape
        moved = np.full_like(self.cells, self._unseen)
        if abs(down) < rows and abs(right) < columns:
            moved[max(0, -down) : rows - max(0, down), max(0, -right) : columns - max(0, right)] = self.cells[
                max(0, down) : rows - max(0, -down), max(0, right) : columns - max(0, -right)
            ]
        self.cells = moved
