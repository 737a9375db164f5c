"""Navigation function: the cost from the start to each cell, and the descent back to the start.

As navfn: a wave from the start over the four neighbours, interpolated between them, so that its level lines are
nearly circles and the descent has no stairs. Differences: cells leave a heap in order of cost, where navfn takes them
in rough batches, and the interpolation is the exact solution of the eikonal equation (Sethian, A fast marching level
set method, 1996), of which navfn's is a quadratic fit.
"""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np

from diff_encoder_sim.base.compiled import compiled

STEP_CELLS = 0.5  # along the descent, navfn's pathStep


@compiled
def propagate(
    weights: np.ndarray,
    start_row: int,
    start_column: int,
    goal_row: int,
    goal_column: int,
    least_weight: float,
    uses_heuristic: bool,
    stops_at_goal: bool,
) -> np.ndarray:
    """Return the potential (rows, columns) float64: the cost from the start, inf where not reached.

    Weights (rows, columns) float64 are the cost of crossing a cell, inf where it is blocked, none below
    `least_weight`. `uses_heuristic` is A* instead of Dijkstra; `stops_at_goal` ends the search once the potential
    around the goal is settled.
    """
    rows, columns = weights.shape
    potential = np.full((rows, columns), np.inf)
    keys, cells = np.empty(4 * (rows + columns)), np.empty(4 * (rows + columns), np.int64)
    potential[start_row, start_column] = 0.0
    keys[0], cells[0], size = 0.0, start_row * columns + start_column, 1
    enough = np.inf
    # A* reaches cells before both neighbours that they depend on are settled. Corrections below a hundredth of a
    # cell are dropped: each would spread to all cells behind it.
    least_gain = 0.01 * least_weight if uses_heuristic else 1e-9
    while size > 0:
        key, cell = keys[0], cells[0]
        size = _pop(keys, cells, size)
        row, column = cell // columns, cell % columns
        ahead = least_weight * math.hypot(row - goal_row, column - goal_column) if uses_heuristic else 0.0
        if key > potential[row, column] + ahead + 1e-9:
            continue  # a cheaper entry for this cell came first
        if key > enough:
            break
        if stops_at_goal and row == goal_row and column == goal_column:
            # The descent from the goal also looks at the cells next to it.
            enough = key + 3.0 * weights[row, column]
        for side in range(4):
            to_row = row + (side == 0) - (side == 1)
            to_column = column + (side == 2) - (side == 3)
            if not (0 <= to_row < rows and 0 <= to_column < columns):
                continue
            cost = _wave(potential, weights, to_row, to_column)
            if cost < potential[to_row, to_column] - least_gain:
                potential[to_row, to_column] = cost
                if uses_heuristic:
                    cost += least_weight * math.hypot(to_row - goal_row, to_column - goal_column)
                if size == len(keys):
                    keys, cells = _twice_as_long(keys, cells)
                size = _push(keys, cells, size, cost, to_row * columns + to_column)
    return potential


@compiled
def _wave(potential: np.ndarray, weights: np.ndarray, row: int, column: int) -> float:
    """Return the cost at a cell of a wave over its cheaper neighbour along each axis."""
    rows, columns = potential.shape
    weight = weights[row, column]
    if weight == np.inf:
        return np.inf
    along = min(
        potential[row, column - 1] if column > 0 else np.inf,
        potential[row, column + 1] if column + 1 < columns else np.inf,
    )
    across = min(
        potential[row - 1, column] if row > 0 else np.inf, potential[row + 1, column] if row + 1 < rows else np.inf
    )
    low, high = min(along, across), max(along, across)
    if high - low >= weight:
        return float(low + weight)
    apart = high - low
    return float(low + 0.5 * (apart + math.sqrt(2.0 * weight * weight - apart * apart)))


@compiled
def _twice_as_long(keys: np.ndarray, cells: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return a heap with twice the space."""
    more_keys, more_cells = np.empty(2 * len(keys)), np.empty(2 * len(cells), np.int64)
    for place in range(len(keys)):
        more_keys[place], more_cells[place] = keys[place], cells[place]
    return more_keys, more_cells


@compiled
def _push(keys: np.ndarray, cells: np.ndarray, size: int, key: float, cell: int) -> int:
    """Add a cell to the heap; return its size."""
    place = size
    while place > 0:
        parent = (place - 1) // 2
        if keys[parent] <= key:
            break
        keys[place], cells[place] = keys[parent], cells[parent]
        place = parent
    keys[place], cells[place] = key, cell
    return size + 1


@compiled
def _pop(keys: np.ndarray, cells: np.ndarray, size: int) -> int:
    """Remove the cell with the least key from the heap; return its size."""
    size -= 1
    key, cell, place = keys[size], cells[size], 0
    while 2 * place + 1 < size:
        child = 2 * place + 1
        if child + 1 < size and keys[child + 1] < keys[child]:
            child += 1
        if keys[child] >= key:
            break
        keys[place], cells[place] = keys[child], cells[child]
        place = child
    keys[place], cells[place] = key, cell
    return size


@compiled
def descend(potential: np.ndarray, row: int, column: int) -> np.ndarray:
    """Return the path (n, 2) of columns and rows from a cell down to the start; cell centres are whole numbers.

    Along the gradient in steps of half a cell; where that does not descend (beside obstacles), to the lowest
    neighbour. Empty if no path descends to the start.
    """
    path = np.empty((4 * potential.size + 4, 2))
    x, y = float(column), float(row)
    height = potential[row, column]
    count = 0
    while count < len(path) - 1:
        path[count, 0], path[count, 1] = x, y
        count += 1
        row, column = int(round(y)), int(round(x))
        if potential[row, column] == 0.0:
            return path[:count].copy()
        to_x, to_y = _along_gradient(potential, x, y)
        to_height = _interpolated(potential, to_x, to_y)
        if not to_height < height:
            to_row, to_column = _lowest_neighbour(potential, row, column)
            if to_row == row and to_column == column:
                break
            to_x, to_y, to_height = float(to_column), float(to_row), potential[to_row, to_column]
        x, y, height = to_x, to_y, to_height
    return path[:0].copy()


@compiled
def _along_gradient(potential: np.ndarray, x: float, y: float) -> Tuple[float, float]:
    """Return the next point downhill, (x, y) itself if the four nodes around it give no direction."""
    row, column = int(math.floor(y)), int(math.floor(x))
    if not (0 <= row < potential.shape[0] - 1 and 0 <= column < potential.shape[1] - 1):
        return x, y
    right, down = x - column, y - row
    x_sum, y_sum = 0.0, 0.0
    for corner in range(4):
        at_row, at_column = row + corner // 2, column + corner % 2
        if potential[at_row, at_column] == np.inf:
            return x, y
        fraction = (down if corner // 2 else 1.0 - down) * (right if corner % 2 else 1.0 - right)
        x_slope = _slope(potential, at_row, at_column, 0, 1)
        y_slope = _slope(potential, at_row, at_column, 1, 0)
        steepness = math.hypot(x_slope, y_slope)
        if steepness > 0.0:
            x_sum += fraction * x_slope / steepness
            y_sum += fraction * y_slope / steepness
    norm = math.hypot(x_sum, y_sum)
    if norm < 1e-6:
        return x, y
    return x - STEP_CELLS * x_sum / norm, y - STEP_CELLS * y_sum / norm


@compiled
def _slope(potential: np.ndarray, row: int, column: int, down: int, right: int) -> float:
    """Return the slope along an axis from the neighbours that have a potential."""
    slope = 0.0
    if row - down >= 0 and column - right >= 0 and potential[row - down, column - right] < np.inf:
        slope += potential[row, column] - potential[row - down, column - right]
    if (
        row + down < potential.shape[0]
        and column + right < potential.shape[1]
        and potential[row + down, column + right] < np.inf
    ):
        slope += potential[row + down, column + right] - potential[row, column]
    return slope


@compiled
def _interpolated(potential: np.ndarray, x: float, y: float) -> float:
    """Return the potential between cell centres, inf beside blocked cells and outside the grid."""
    row, column = int(math.floor(y)), int(math.floor(x))
    if not (0 <= row < potential.shape[0] - 1 and 0 <= column < potential.shape[1] - 1):
        return np.inf
    right, down = x - column, y - row
    height = 0.0
    for corner in range(4):
        fraction = (down if corner // 2 else 1.0 - down) * (right if corner % 2 else 1.0 - right)
        if fraction > 0.0:  # 0 times infinity is no number
            height += fraction * potential[row + corner // 2, column + corner % 2]
    return height


@compiled
def _lowest_neighbour(potential: np.ndarray, row: int, column: int) -> Tuple[int, int]:
    """Return the lowest of the eight neighbours or the cell itself, without cutting blocked corners."""
    rows, columns = potential.shape
    lowest_row, lowest_column = row, column
    for down in range(-1, 2):
        for right in range(-1, 2):
            to_row, to_column = row + down, column + right
            if not (0 <= to_row < rows and 0 <= to_column < columns):
                continue
            if potential[to_row, column] == np.inf or potential[row, to_column] == np.inf:
                continue
            if potential[to_row, to_column] < potential[lowest_row, lowest_column]:
                lowest_row, lowest_column = to_row, to_column
    return lowest_row, lowest_column
