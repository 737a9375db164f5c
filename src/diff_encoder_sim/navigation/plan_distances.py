"""Distances over the free cells of a costmap from a plan, or from its last point in the window.

base_local_planner's MapGrid: a wavefront over the four neighbours, in cells. A wave spreads only as far as somebody
asks: what the robot can reach in a period is a small part of the window.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.compiled import compiled
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.navigation.cost_values import INSCRIBED, NO_INFORMATION

# The waves: from the plan, from its end, from the nose's goal beyond it.
TO_PLAN, TO_END, TO_FRONT = range(3)


class Waves(NamedTuple):
    """Three wavefronts over one costmap.

    `cells` holds distances inside a fence, which spares the waves the check for the grid's edge: cells that block the
    robot's centre get the number of cells, those not reached (yet) one more, both farther than any path, and those
    that would block two more.
    """

    cells: np.ndarray  # (3, (rows + 2) * (columns + 2)) int32
    queues: np.ndarray  # (3, rows * columns) int32, places in `cells` in the order in which they are reached
    counts: np.ndarray  # (3, 2) int64: places that are taken from the queue, and put into it


def make_waves(shape: Tuple[int, int]) -> Waves:
    """Make waves for costmaps of (rows, columns)."""
    rows, columns = shape
    size = rows * columns
    cells = np.full((3, (rows + 2) * (columns + 2)), size, np.int32)
    return Waves(cells, np.empty((3, size), np.int32), np.zeros((3, 2), np.int64))


@compiled
def begin_waves(
    costs: np.ndarray, per_m: float, origin: Pose2D, plan: np.ndarray, pose: Pose2D, nose_m: float, waves: Waves
) -> bool:
    """Begin waves at the plan, at its end, and at the nose's goal beyond it.

    The plan (n, 3), n > 0, is in the frame of the grid's origin; `pose` is the robot in the grid's own frame, its nose
    `nose_m` ahead of its centre. Waves from an end begin at the last point before the plan leaves the
    grid. Returns False if no point is on known cells.
    """
    _forget(costs, waves)
    cos_yaw, sin_yaw = math.cos(origin.yaw_rad), math.sin(origin.yaw_rad)
    x_before_m, y_before_m, place, front_place = 0.0, 0.0, -1, -1
    for index in range(len(plan)):
        x_m, y_m = plan[index, 0] - origin.x_m, plan[index, 1] - origin.y_m
        x_m, y_m = x_m * cos_yaw + y_m * sin_yaw, y_m * cos_yaw - x_m * sin_yaw
        if index == len(plan) - 1:
            # The nose's goal is beyond the goal as seen from the robot, not along the goal's heading, which would
            # swing around when the robot must turn at the end.
            bearing_rad = math.atan2(y_m - pose.y_m, x_m - pose.x_m)
            x_front_m, y_front_m = x_m + nose_m * math.cos(bearing_rad), y_m + nose_m * math.sin(bearing_rad)
            if index == 0:
                x_before_m, y_before_m = x_front_m, y_front_m
            front_place, _ = _walk(costs, per_m, x_before_m, y_before_m, x_front_m, y_front_m, place, False, waves)
        if index == 0:
            x_before_m, y_before_m = x_m, y_m
        place, has_left = _walk(costs, per_m, x_before_m, y_before_m, x_m, y_m, place, True, waves)
        if has_left:
            if index < len(plan) - 1:
                front_place = place
            break
        x_before_m, y_before_m = x_m, y_m
    _begin_at(TO_END, place, waves)
    _begin_at(TO_FRONT, front_place, waves)
    return place >= 0 and front_place >= 0


@compiled
def _forget(costs: np.ndarray, waves: Waves) -> None:
    """Make all cells not reached."""
    rows, columns = costs.shape
    unreached = np.int32(rows * columns + 1)
    cells, counts = waves.cells, waves.counts
    for layer in range(len(cells)):
        counts[layer, 0] = counts[layer, 1] = 0
        for row in range(rows):
            first = (row + 1) * (columns + 2) + 1
            for column in range(columns):
                cells[layer, first + column] = unreached + np.int32(costs[row, column] >= INSCRIBED)


@compiled
def _walk(
    costs: np.ndarray,
    per_m: float,
    x_m: float,
    y_m: float,
    to_x_m: float,
    to_y_m: float,
    place: int,
    marks: bool,
    waves: Waves,
) -> Tuple[int, bool]:
    """Go along a line that follows a `place`, -1 for none yet; if it `marks`, the plan's wave begins at its cells.

    Returns the last place on known cells, and whether the line has left them.
    """
    rows, columns = costs.shape
    x_step, y_step = to_x_m - x_m, to_y_m - y_m
    # Points farther apart than a cell leave no gaps.
    steps = max(1, math.ceil(math.sqrt(x_step * x_step + y_step * y_step) * per_m))
    for step in range(1, steps + 1):
        row = math.floor((y_m + y_step * step / steps) * per_m)
        column = math.floor((x_m + x_step * step / steps) * per_m)
        if 0 <= row < rows and 0 <= column < columns and costs[row, column] != NO_INFORMATION:
            place = (row + 1) * (columns + 2) + column + 1
            if marks and waves.cells[TO_PLAN, place] != 0:
                _begin_at(TO_PLAN, place, waves)
        elif place >= 0:
            return place, True
    return place, False


@compiled
def _begin_at(layer: int, place: int, waves: Waves) -> None:
    """Have a wave begin at a place, too; -1 is none."""
    if place >= 0:
        waves.cells[layer, place] = 0
        waves.queues[layer, waves.counts[layer, 1]] = place
        waves.counts[layer, 1] += 1


@compiled
def distance_to(
    cells: np.ndarray,
    queues: np.ndarray,
    counts: np.ndarray,
    layer: int,
    size: int,
    columns: int,
    row: int,
    column: int,
) -> int:
    """Return the distance [cells] of a cell on the grid of `size` cells, once the wave has come to it.

    The first three arguments are those of Waves.
    """
    place = (row + 1) * (columns + 2) + column + 1
    if cells[layer, place] > size:
        spread(cells, queues, counts, layer, size, columns + 2, place)
    return int(min(cells[layer, place], size + 1))


@compiled
def spread(
    cells: np.ndarray, queues: np.ndarray, counts: np.ndarray, layer: int, size: int, wide: int, place: int
) -> None:
    """Run a wave over a fenced grid, `wide` cells a row, until it comes to a place; -1 is nowhere, so to its end."""
    unreached = size + 1
    taken, filled = counts[layer, 0], counts[layer, 1]
    while taken < filled and (place < 0 or cells[layer, place] >= unreached):
        cell = queues[layer, taken]
        taken += 1
        farther = cells[layer, cell] + 1
        for step in (-wide, wide, -1, 1):
            to_cell = cell + step
            if cells[layer, to_cell] == unreached:
                cells[layer, to_cell] = farther
                queues[layer, filled] = to_cell
                filled += 1
            elif cells[layer, to_cell] > unreached:
                cells[layer, to_cell] = size  # blocked
    counts[layer, 0], counts[layer, 1] = taken, filled


@compiled
def whole_grid(waves: Waves, layer: int, rows: int, columns: int) -> np.ndarray:
    """Return the distances [cells] of all cells, (rows, columns) int32."""
    size = rows * columns
    spread(waves.cells, waves.queues, waves.counts, layer, size, columns + 2, -1)
    fenced = waves.cells[layer].reshape((rows + 2, columns + 2))
    grid: np.ndarray = np.minimum(fenced[1:-1, 1:-1], np.int32(size + 1))
    return grid
