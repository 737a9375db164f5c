"""Global planner: the cheapest path over a costmap, as navfn."""

from __future__ import annotations

import heapq
import math
from typing import Optional, Tuple

import numpy as np

from diff_encoder_sim.base.kernels import Array, compiled
from diff_encoder_sim.base.se2 import Pose2D, transform_points
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.costmap_params import INSCRIBED, LETHAL, NO_INFORMATION
from diff_encoder_sim.navigation.navigator_inputs import FARTHEST_M
from diff_encoder_sim.navigation.navigator_params import NavfnParams


class PlanError(ValueError):
    """No plan was found; the text names the pose and the reason in one line.

    It `is_lasting` if neither waiting nor clearing obstacles can help.
    """

    def __init__(self, text: str, is_lasting: bool = False) -> None:
        super().__init__(text)
        self.is_lasting = is_lasting


STEP_CELLS = 0.5  # along the descent, navfn's pathStep
Cell = Tuple[int, int]  # row, column


@compiled
def propagate(
    weights: Array, start_cell: Cell, goal_cell: Cell, least_weight: float, uses_heuristic: bool, stops_at_goal: bool
) -> np.ndarray:
    """Return the potential (rows, columns) float64: the cost from the start, inf if not reached.

    Weights (rows, columns) float64 are the cost of crossing a cell, at least `least_weight`, inf if blocked, as the
    outermost cells are. `uses_heuristic` is A*; `stops_at_goal` ends the search when cells around it are settled.
    """
    columns, (goal_row, goal_column) = weights.shape[1], goal_cell
    start, goal = start_cell[0] * columns + start_cell[1], goal_row * columns + goal_column
    weight_of_cell, potential = weights.ravel(), np.full(weights.size, np.inf)
    potential[start], heap, enough = 0.0, [(0.0, start)], np.inf
    # A* reaches cells before both neighbours that they depend on are settled. Corrections below a hundredth of a
    # cell are dropped: each would spread to all cells behind it.
    least_gain = 0.01 * least_weight if uses_heuristic else 1e-9
    ahead = to_ahead = 0.0  # least cost from a cell to the goal
    while heap:
        key, cell = heapq.heappop(heap)
        if uses_heuristic:
            ahead = least_weight * math.hypot(cell // columns - goal_row, cell % columns - goal_column)
        if key > potential[cell] + ahead + 1e-9:
            continue  # a cheaper entry for this cell came first
        if key > enough:
            break
        if stops_at_goal and cell == goal:
            enough = key + 3.0 * weight_of_cell[cell]  # the descent also looks at the cells next to the goal
        for step in (columns, -columns, 1, -1):
            to_cell = np.uintp(cell + step)  # spares the check for negative indices
            if weight_of_cell[to_cell] == np.inf or (potential[to_cell] <= key and not uses_heuristic):
                continue  # blocked or settled
            cost = _wave(potential, weight_of_cell[to_cell], to_cell, np.uintp(columns))
            if cost < potential[to_cell] - least_gain:
                potential[to_cell] = cost
                if uses_heuristic:
                    to_row, to_column = (cell + step) // columns, (cell + step) % columns
                    to_ahead = least_weight * math.hypot(to_row - goal_row, to_column - goal_column)
                heapq.heappush(heap, (cost + to_ahead, cell + step))
    return potential.reshape(weights.shape)


@compiled
def _wave(potential: Array, weight: float, cell: np.uintp, columns: np.uintp) -> float:
    """Return the cost at a cell of a wave over its cheaper neighbour along each axis."""
    along = min(potential[cell - np.uintp(1)], potential[cell + np.uintp(1)])
    across = min(potential[cell - columns], potential[cell + columns])
    low, apart = min(along, across), abs(along - across)
    more = weight if apart >= weight else 0.5 * (apart + math.sqrt(2.0 * weight * weight - apart * apart))
    return float(low + more)


@compiled
def descend(potential: Array, row: int, column: int) -> np.ndarray:
    """Return the path (n, 2) of columns and rows from a cell down to the start, (0, 2) if none descends to it.

    In steps of half a cell along the gradient, or to the lowest neighbour if that does not descend (near obstacles).
    """
    path = np.empty((4 * potential.size + 4, 2))
    x, y, height, count = float(column), float(row), potential[row, column], 0
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
def _along_gradient(potential: Array, x: float, y: float) -> Tuple[float, float]:
    """Return the next point downhill, (x, y) itself if the four nodes around it give no direction."""
    row, column = int(math.floor(y)), int(math.floor(x))
    right, down = x - column, y - row
    x_sum = y_sum = 0.0
    for corner in range(4):
        at_row, at_column = row + corner // 2, column + corner % 2
        if potential[at_row, at_column] == np.inf:
            return x, y
        fraction = (down if corner // 2 else 1.0 - down) * (right if corner % 2 else 1.0 - right)
        x_slope, y_slope = _slope(potential, at_row, at_column, 0, 1), _slope(potential, at_row, at_column, 1, 0)
        steepness = math.hypot(x_slope, y_slope)
        if steepness > 0.0:
            x_sum += fraction * x_slope / steepness
            y_sum += fraction * y_slope / steepness
    norm = math.hypot(x_sum, y_sum)
    if norm < 1e-6:
        return x, y
    return x - STEP_CELLS * x_sum / norm, y - STEP_CELLS * y_sum / norm


@compiled
def _slope(potential: Array, row: int, column: int, down: int, right: int) -> float:
    """Return the slope along an axis from the neighbours that have a potential."""
    here, before = potential[row, column], potential[row - down, column - right]
    after = potential[row + down, column + right]
    slope = here - before if before < np.inf else 0.0
    return slope + (after - here if after < np.inf else 0.0)


@compiled
def _interpolated(potential: Array, x: float, y: float) -> float:
    """Return the potential between cell centres, inf next to blocked cells."""
    row, column = int(math.floor(y)), int(math.floor(x))
    right, down, height = x - column, y - row, 0.0
    for corner in range(4):
        fraction = (down if corner // 2 else 1.0 - down) * (right if corner % 2 else 1.0 - right)
        if fraction > 0.0:  # 0 times infinity is NaN
            height += fraction * potential[row + corner // 2, column + corner % 2]
    return height


@compiled
def _lowest_neighbour(potential: Array, row: int, column: int) -> Tuple[int, int]:
    """Return the lowest of the eight neighbours or the cell itself, without cutting blocked corners."""
    lowest_row, lowest_column = row, column
    for down in range(-1, 2):
        for right in range(-1, 2):
            to_row, to_column = row + down, column + right
            is_cut_off = potential[to_row, column] == np.inf or potential[row, to_column] == np.inf
            if not is_cut_off and potential[to_row, to_column] < potential[lowest_row, lowest_column]:
                lowest_row, lowest_column = to_row, to_column
    return lowest_row, lowest_column


BLOCKED_WEIGHT = 254  # navfn's COST_OBS: from here on a cell is blocked; unknown space has one less


class GlobalPlanner:
    """Makes plans over a costmap; no plan depends on the ones before."""

    def __init__(self, params: NavfnParams, costmap: Costmap) -> None:
        self.params = params
        self.costmap = costmap
        weights = np.minimum(params.neutral_cost + params.cost_factor * np.arange(256), BLOCKED_WEIGHT - 1)
        weights[INSCRIBED:] = math.inf
        weights[NO_INFORMATION] = BLOCKED_WEIGHT - 1 if params.allow_unknown else math.inf
        self._weight_of_cost = weights

    def make_plan(self, start: Pose2D, goal: Pose2D, tolerance_m: float = 0.0) -> np.ndarray:
        """Return a plan (n, 3) x, y [m], yaw [rad], n >= 2, in the costmap's frame; raise PlanError if there is none.

        Points are about half a cell apart. A blocked goal may be replaced by the nearest reachable point within
        `tolerance_m`, or default_tolerance if larger, along x and y.
        """
        tolerance_m = max(tolerance_m, self.params.default_tolerance)
        start_cell, goal_cell = self._cell_of('the start', start), self._cell_of('the goal', goal)
        weights = self._weights(start_cell)
        goal_is_free = weights[goal_cell] < math.inf
        if not goal_is_free and tolerance_m == 0.0:
            raise self._blocked(goal)
        # The potential must be settled at the goal if that is free, else everywhere near it.
        how = not self.params.use_dijkstra and goal_is_free, goal_is_free and tolerance_m == 0.0
        potential = propagate(weights, start_cell, goal_cell, self.params.neutral_cost, *how)
        end_cell: Optional[Cell] = goal_cell
        if potential[goal_cell] == math.inf:  # the nearest one that is reached
            cells = np.argwhere(potential < math.inf)
            away = np.abs(cells - goal_cell)
            is_near = away.max(axis=1) <= math.floor(tolerance_m * self.costmap.cells_per_m)
            squared = np.where(is_near, (away**2).sum(axis=1), math.inf)
            nearest = int(np.argmin(squared))
            end_cell = (int(cells[nearest, 0]), int(cells[nearest, 1])) if is_near.any() else None
        path = descend(potential, *end_cell)[::-1] if end_cell else np.empty((0, 2))
        if end_cell is None or len(path) == 0:
            raise PlanError(f'there is no path to the goal ({goal.x_m:.2f}, {goal.y_m:.2f})')
        origin, cell_m, end = self.costmap.origin, self.costmap.resolution_m, goal
        if end_cell != goal_cell:
            end = origin.compose(Pose2D((end_cell[1] + 0.5) * cell_m, (end_cell[0] + 0.5) * cell_m, 0.0))
        middle_m = transform_points(origin, ((path + 0.5) * cell_m)[1:-1])
        positions_m = np.vstack([[start[:2]], middle_m, [end[:2]]])  # the ends are the exact poses
        steps_m = np.diff(positions_m, axis=0)
        return np.column_stack([positions_m, np.append(np.arctan2(steps_m[:, 1], steps_m[:, 0]), goal.yaw_rad)])

    def _cell_of(self, what: str, pose: Pose2D) -> Cell:
        """Return the cell of a pose, which may not be in the outermost cells: as in navfn they are blocked."""
        if not all(math.isfinite(value) for value in pose):
            raise PlanError(f'{what} ({pose.x_m}, {pose.y_m}, {pose.yaw_rad}) is not finite', is_lasting=True)
        if max(abs(pose.x_m), abs(pose.y_m)) <= FARTHEST_M:
            row, column = self.costmap.cell_at(pose.x_m, pose.y_m)
            rows, columns = self.costmap.shape
            if 0 < row < rows - 1 and 0 < column < columns - 1:
                return row, column
        raise PlanError(f'{what} ({pose.x_m:.6g}, {pose.y_m:.6g}) is outside the map', is_lasting=True)

    def _weights(self, start_cell: Cell) -> np.ndarray:
        """Return the cost (rows, columns) of crossing each cell; the robot may always leave its own place."""
        costs = self.costmap.costs
        weights: np.ndarray = self._weight_of_cost[costs]
        if costs[start_cell] >= INSCRIBED:
            reach = math.ceil(self.costmap.footprint.inscribed_radius_m * self.costmap.cells_per_m)
            near = tuple(slice(max(0, cell - reach), cell + reach + 1) for cell in start_cell)
            weights[near][costs[near] == INSCRIBED] = BLOCKED_WEIGHT - 1
        weights[[0, -1], :] = weights[:, [0, -1]] = math.inf
        weights[start_cell] = self.params.neutral_cost
        return weights

    def _blocked(self, goal: Pose2D) -> PlanError:
        where = f'the goal ({goal.x_m:.2f}, {goal.y_m:.2f})'
        cost = self.costmap.cost_at(goal.x_m, goal.y_m)
        if cost == NO_INFORMATION:
            return PlanError(f'{where} is in unknown space')
        is_wall = self.costmap.is_static_obstacle(goal.x_m, goal.y_m)
        what = 'a wall of the map' if is_wall else 'an obstacle'
        near = f'in {what}' if cost == LETHAL else f'so close to {what} that the robot would touch it'
        return PlanError(f'{where} is {near}', is_lasting=is_wall)
