"""Points that show what the DWA has chosen from: dwa_local_planner's trajectory_cloud and cost_cloud.

The search leaves out what cannot be the best. It is scored here, so that only a display costs time.
"""

from __future__ import annotations

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D, transform_points
from diff_encoder_sim.navigation.cost_values import INSCRIBED
from diff_encoder_sim.navigation.critics import GOAL, OBSTACLE, PATH
from diff_encoder_sim.navigation.dwa_search import ScoringTask, score_all
from diff_encoder_sim.navigation.plan_distances import TO_END, TO_PLAN, whole_grid

TRAJECTORY_FIELDS = ('x', 'y', 'z', 'theta', 'cost')
COST_FIELDS = ('x', 'y', 'z', 'path_cost', 'goal_cost', 'occ_cost', 'total_cost')


def trajectory_cloud(task: ScoringTask, origin: Pose2D) -> np.ndarray:
    """Return the points (n, 5) of all trajectories that no critic rejects, each with the cost of its trajectory.

    Columns are TRAJECTORY_FIELDS, in the frame of `origin`, the grid's.
    """
    _, steps, all_points, _, totals = score_all(task)
    accepted = np.flatnonzero(totals >= 0.0)
    if len(accepted) == 0:
        return np.empty((0, len(TRAJECTORY_FIELDS)))
    points = np.concatenate([all_points[index, : steps[index]] for index in accepted])
    placed = transform_points(origin, points[:, :2])
    costs = np.repeat(totals[accepted], steps[accepted])
    return np.column_stack([placed, np.zeros(len(points)), points[:, 2] + origin.yaw_rad, costs])


def cost_cloud(task: ScoringTask, origin: Pose2D) -> np.ndarray:
    """Return the centres (n, 7) of the cells that the robot's centre can reach, with the costs of standing there.

    Columns are COST_FIELDS, in the frame of `origin`, the grid's. Distances are in cells, the total is weighted.
    """
    scene = task.scene
    to_plan, to_end = (whole_grid(scene.waves, layer, *scene.costs.shape) for layer in (TO_PLAN, TO_END))
    rows, columns = np.nonzero((to_plan < to_plan.size) & (scene.costs < INSCRIBED))
    centres = transform_points(origin, (np.column_stack([columns, rows]) + 0.5) / scene.per_m)
    path, goal, obstacle = to_plan[rows, columns], to_end[rows, columns], scene.costs[rows, columns]
    total = scene.scales[PATH] * path + scene.scales[GOAL] * goal + scene.scales[OBSTACLE] * obstacle
    return np.column_stack([centres, np.zeros(len(rows)), path, goal, obstacle, total])
