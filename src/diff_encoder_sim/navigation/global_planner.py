"""Global planner: the cheapest path over a costmap, as navfn."""

from __future__ import annotations

import math
from typing import Tuple

import numpy as np
from pydantic import Field
from typing_extensions import Annotated

from diff_encoder_sim.base.bounded_numbers import Between, Distance_m, Place_m, Weight
from diff_encoder_sim.base.se2 import Pose2D, transform_points
from diff_encoder_sim.base.typed_params import Params
from diff_encoder_sim.navigation.cost_values import INSCRIBED, LETHAL, NO_INFORMATION
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.navigator_inputs import FARTHEST_M
from diff_encoder_sim.navigation.plan_error import PlanError, PlanProblem
from diff_encoder_sim.navigation.potential import descend, propagate

# navfn's COST_OBS: from here on a cell is blocked; unknown space has one less.
BLOCKED_WEIGHT = 254


class NavfnParams(Params):
    """Parameters of the global planner, under navfn's and global_planner's names."""

    allow_unknown: bool = Field(True, description='plan through unknown cells')
    default_tolerance: Distance_m = Field(0.0, description='how far from a blocked goal a plan may end [m]')
    use_dijkstra: bool = Field(True, description='false: A*')
    neutral_cost: Annotated[float, Between(1.0, 253.0)] = Field(50.0, description='cost of a free cell')
    cost_factor: Weight = Field(0.8, description="weight of the costmap's cost, added to it")
    planner_window_x: Place_m = Field(0.0, description='accepted, without effect, as upstream [m]')
    planner_window_y: Place_m = Field(0.0, description='accepted, without effect, as upstream [m]')
    visualize_potential: bool = Field(False, description='accepted, without effect')


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
        """Return a plan (n, 3) x, y [m], yaw [rad] from start to goal in the costmap's frame; n >= 2.

        Points are about half a cell apart and point along the path, the last one as the goal. A blocked goal may be
        replaced by the nearest reachable point within `tolerance_m`, or default_tolerance if that is larger, along x
        and y.

        Raises:
            PlanError: there is no plan; the text gives the reason.
        """
        if not math.isfinite(tolerance_m):
            raise PlanError(PlanProblem.NOT_FINITE, f'the tolerance {tolerance_m} is not finite')
        tolerance_m = max(tolerance_m, self.params.default_tolerance)
        start_cell, goal_cell = self._cell_of('the start', start), self._cell_of('the goal', goal)
        potential = self._potential(start_cell, goal_cell, goal, tolerance_m)
        end_cell = self._end_cell(potential, goal_cell, goal, tolerance_m)
        path = descend(potential, *end_cell)[::-1]
        if len(path) == 0:
            raise self._unreachable(goal)
        end = goal if end_cell == goal_cell else self._centre(end_cell)._replace(yaw_rad=goal.yaw_rad)
        return self._plan_along(path, start, end)

    def _potential(
        self, start_cell: Tuple[int, int], goal_cell: Tuple[int, int], goal: Pose2D, tolerance_m: float
    ) -> np.ndarray:
        """Return the potential (rows, columns), settled at least at the goal if that is free."""
        weights = self._weights(start_cell)
        goal_is_free = weights[goal_cell] < math.inf
        if not goal_is_free and tolerance_m == 0.0:
            raise self._blocked(goal)
        uses_heuristic = not self.params.use_dijkstra and goal_is_free
        stops_at_goal = goal_is_free and tolerance_m == 0.0
        least_weight = self.params.neutral_cost
        return propagate(weights, *start_cell, *goal_cell, least_weight, uses_heuristic, stops_at_goal)

    def _cell_of(self, what: str, pose: Pose2D) -> Tuple[int, int]:
        """Return the cell of a pose, which may not be in the outermost cells: as in navfn they are blocked."""
        if not all(math.isfinite(value) for value in pose):
            raise PlanError(PlanProblem.NOT_FINITE, f'{what} ({pose.x_m}, {pose.y_m}, {pose.yaw_rad}) is not finite')
        if max(abs(pose.x_m), abs(pose.y_m)) <= FARTHEST_M:
            row, column = self.costmap.cell_at(pose.x_m, pose.y_m)
            rows, columns = self.costmap.shape
            if 0 < row < rows - 1 and 0 < column < columns - 1:
                return row, column
        raise PlanError(PlanProblem.OUTSIDE, f'{what} ({pose.x_m:.6g}, {pose.y_m:.6g}) is outside the map')

    def _weights(self, start_cell: Tuple[int, int]) -> np.ndarray:
        """Return the cost (rows, columns) of crossing each cell; the robot may always leave its own place."""
        costs = self.costmap.costs
        weights: np.ndarray = self._weight_of_cost[costs]
        weights[[0, -1], :] = weights[:, [0, -1]] = math.inf
        if costs[start_cell] >= INSCRIBED:
            reach = math.ceil(self.costmap.footprint.inscribed_radius_m * self.costmap.cells_per_m)
            rows, columns = (slice(max(1, cell - reach), cell + reach + 1) for cell in start_cell)
            near = weights[rows, columns]
            near[costs[rows, columns] == INSCRIBED] = BLOCKED_WEIGHT - 1
            weights[[0, -1], :] = weights[:, [0, -1]] = math.inf
        weights[start_cell] = self.params.neutral_cost
        return weights

    def _end_cell(
        self, potential: np.ndarray, goal_cell: Tuple[int, int], goal: Pose2D, tolerance_m: float
    ) -> Tuple[int, int]:
        """Return the goal's cell, or the nearest reachable one within the tolerance."""
        if potential[goal_cell] < math.inf:
            return goal_cell
        reach = math.floor(tolerance_m * self.costmap.cells_per_m)
        top, left = max(0, goal_cell[0] - reach), max(0, goal_cell[1] - reach)
        near = potential[top : goal_cell[0] + reach + 1, left : goal_cell[1] + reach + 1]
        rows, columns = np.nonzero(near < math.inf)
        if len(rows) == 0:
            raise self._unreachable(goal)
        squared = (rows + top - goal_cell[0]) ** 2 + (columns + left - goal_cell[1]) ** 2
        nearest = int(np.argmin(squared))
        return int(rows[nearest]) + top, int(columns[nearest]) + left

    def _centre(self, cell: Tuple[int, int]) -> Pose2D:
        resolution_m = self.costmap.resolution_m
        return self.costmap.origin.compose(Pose2D((cell[1] + 0.5) * resolution_m, (cell[0] + 0.5) * resolution_m, 0.0))

    def _plan_along(self, path: np.ndarray, start: Pose2D, end: Pose2D) -> np.ndarray:
        """Return the plan of a path in cells (n, 2), its ends replaced by the exact poses."""
        local_m = (path + 0.5) * self.costmap.resolution_m
        middle_m = transform_points(self.costmap.origin, local_m[1:-1])
        positions_m = np.vstack([[start[:2]], middle_m, [end[:2]]])
        steps_m = np.diff(positions_m, axis=0)
        yaws_rad = np.append(np.arctan2(steps_m[:, 1], steps_m[:, 0]), end.yaw_rad)
        return np.column_stack([positions_m, yaws_rad])

    def _blocked(self, goal: Pose2D) -> PlanError:
        where = f'the goal ({goal.x_m:.2f}, {goal.y_m:.2f})'
        cost = self.costmap.cost_at(goal.x_m, goal.y_m)
        if cost == NO_INFORMATION:
            return PlanError(PlanProblem.BLOCKED, f'{where} is in unknown space')
        is_wall = self.costmap.is_static_obstacle(goal.x_m, goal.y_m)
        problem, what = (PlanProblem.IN_WALL, 'a wall of the map') if is_wall else (PlanProblem.BLOCKED, 'an obstacle')
        if cost == LETHAL:
            return PlanError(problem, f'{where} is in {what}')
        return PlanError(problem, f'{where} is so close to {what} that the robot would touch it')

    @staticmethod
    def _unreachable(goal: Pose2D) -> PlanError:
        return PlanError(PlanProblem.UNREACHABLE, f'there is no path to the goal ({goal.x_m:.2f}, {goal.y_m:.2f})')
