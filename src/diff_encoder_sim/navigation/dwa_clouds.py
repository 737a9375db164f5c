"""Points that show what the DWA has chosen from: dwa_local_planner's trajectory_cloud and cost_cloud.

Scores of a control period are incomplete: the search leaves out what cannot be the best. They are completed here, so
that only a display costs time.
"""

from __future__ import annotations

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D, transform_points
from diff_encoder_sim.navigation.cost_values import INSCRIBED
from diff_encoder_sim.navigation.critics import GOAL, OBSTACLE, PATH
from diff_encoder_sim.navigation.dwa import ScoringTask
from diff_encoder_sim.navigation.plan_distances import TO_END, TO_PLAN
from diff_encoder_sim.navigation.trajectory_scoring import score_samples

TRAJECTORY_FIELDS = ('x', 'y', 'z', 'theta', 'cost')
COST_FIELDS = ('x', 'y', 'z', 'path_cost', 'goal_cost', 'occ_cost', 'total_cost')


def trajectory_cloud(task: ScoringTask, origin: Pose2D) -> np.ndarray:
    """Return the points (n, 5) of all trajectories that no critic rejects, each with the cost of its trajectory.

    Columns are TRAJECTORY_FIELDS, in the frame of `origin`, the grid's.
    """
    costs = _all_costs(task)
    accepted = np.flatnonzero((costs >= 0.0) & (task.steps > 0))
    if len(accepted) == 0:
        return np.empty((0, len(TRAJECTORY_FIELDS)))
    points = np.concatenate([task.points[index, : task.steps[index]] for index in accepted])
    placed = transform_points(origin, points[:, :2])
    point_costs = np.repeat(costs[accepted], task.steps[accepted])
    return np.column_stack([placed, np.zeros(len(points)), points[:, 2] + origin.yaw_rad, point_costs])


def cost_cloud(task: ScoringTask, origin: Pose2D) -> np.ndarray:
    """Return the centres (n, 7) of the cells that the robot's centre can reach, with the costs of standing there.

    Columns are COST_FIELDS, in the frame of `origin`, the grid's. Distances are in cells, the total is weighted.
    """
    to_plan, to_end = task.grids[TO_PLAN], task.grids[TO_END]
    rows, columns = np.nonzero((to_plan < to_plan.size) & (task.costs < INSCRIBED))
    centres = transform_points(origin, (np.column_stack([columns, rows]) + 0.5) / task.per_m)
    path, goal, obstacle = to_plan[rows, columns], to_end[rows, columns], task.costs[rows, columns]
    total = task.scales[PATH] * path + task.scales[GOAL] * goal + task.scales[OBSTACLE] * obstacle
    return np.column_stack([centres, np.zeros(len(rows)), path, goal, obstacle, total])


def _all_costs(task: ScoringTask) -> np.ndarray:
    """Return the weighted cost (n,) of every sample, or the first below zero."""
    costs = np.empty(len(task.samples))
    for index in range(len(costs)):
        one = slice(index, index + 1)
        scores, total = np.empty_like(task.scores[one]), np.empty(1)
        alone = task._replace(
            samples=task.samples[one], points=task.points[one], steps=task.steps[one], scores=scores, totals=total
        )
        score_samples(*alone)
        costs[index] = total[0]
    return costs
