"""Dynamic window approach: the best of all velocities that the next control period can reach.

Fox, Burgard and Thrun, The dynamic window approach to collision avoidance, 1997, as dwa_local_planner implements it:
sample the window, roll each sample out into a trajectory, choose by the critics.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D, transform_points, wrap_angle
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.costmap_layers import INSCRIBED
from diff_encoder_sim.navigation.dwa_kernels import (
    GOAL,
    OBSTACLE,
    PATH,
    TO_END,
    TO_PLAN,
    Scene,
    ScoringTask,
    Waves,
    find_cheapest,
    make_waves,
    roll_out,
    rollout_params,
    score_all,
    stays_clear,
    step_count,
    whole_grid,
    window_params,
)
from diff_encoder_sim.navigation.dwa_params import DwaParams


class _Direction:
    """Last direction along one axis, and the one that it is locked to."""

    def __init__(self) -> None:
        self._last_sign = 0
        self.only_sign = 0

    def enter(self, velocity: float) -> bool:
        """Enter a command; return whether it reverses the one before."""
        sign = (velocity > 0.0) - (velocity < 0.0)
        if sign == 0:
            return False
        reverses = self._last_sign == -sign
        self._last_sign = sign
        if reverses:
            self.only_sign = sign
        return reverses

    def allows(self, sign: int) -> bool:
        """Return whether a command of this sign is allowed."""
        return self.only_sign != -sign


class OscillationMemory:
    """Directions that past commands rule out until the robot has moved away from where it reversed."""

    def __init__(self, params: DwaParams) -> None:
        self._params = params
        self.reset()

    def reset(self) -> None:
        """Allow all directions."""
        self._linear, self._angular = _Direction(), _Direction()
        self._reversed_at: Optional[Pose2D] = None

    def allowed(self) -> Tuple[bool, bool, bool, bool]:
        """Return whether forward, backward, left and right are allowed."""
        linear, angular = self._linear, self._angular
        return linear.allows(1), linear.allows(-1), angular.allows(1), angular.allows(-1)

    def update(self, base_pose: Pose2D, linear_mps: float, angular_radps: float) -> None:
        """Enter the command that was chosen at a pose."""
        reversed_now = self._linear.enter(linear_mps)
        # A robot that drives on may weave: turns count only (nearly) in place.
        if abs(linear_mps) <= self._params.min_vel_trans:
            reversed_now = self._angular.enter(angular_radps) or reversed_now
        if reversed_now:
            self._reversed_at = base_pose
        if self._reversed_at is not None and self._has_moved_away(base_pose, self._reversed_at):
            self.reset()

    def _has_moved_away(self, base_pose: Pose2D, since: Pose2D) -> bool:
        params = self._params
        squared_m = (base_pose.x_m - since.x_m) ** 2 + (base_pose.y_m - since.y_m) ** 2
        turned_rad = abs(wrap_angle(base_pose.yaw_rad - since.yaw_rad))
        return squared_m > params.oscillation_reset_dist**2 or turned_rad > params.oscillation_reset_angle


class Trajectory(NamedTuple):
    """A chosen command and the trajectory it was chosen for."""

    linear_mps: float
    angular_radps: float
    cost: float  # weighted sum of the critics
    poses: np.ndarray  # (n, 3) x, y [m], yaw [rad] in the costmap's frame


class DwaPlanner:
    """Chooses a velocity in each control period; remembers only what prevents oscillation.

    Args:
        params: limits, sampling and weights.
        sim_period_s: the control period, 1 / controller_frequency [s].
    """

    def __init__(self, params: DwaParams, sim_period_s: float) -> None:
        self.params = params
        self.oscillation = OscillationMemory(params)
        self.last_task: Optional[ScoringTask] = None  # of the last `find_best`, for displays
        self._window, self._rollout = window_params(params, sim_period_s), rollout_params(params)
        self._waves: Waves = make_waves((0, 0))
        self._waves_shape = (0, 0)

    def find_best(
        self, base_pose: Pose2D, linear_mps: float, angular_radps: float, costmap: Costmap, plan: np.ndarray
    ) -> Optional[Trajectory]:
        """Return the cheapest trajectory, or None if the critics reject all.

        Args:
            base_pose: the robot, in the costmap's frame.
            linear_mps: its forward velocity.
            angular_radps: its turning velocity.
            costmap: the local costmap.
            plan: (n, 3) the stretch of the global plan to follow, in the costmap's frame; n > 0.
        """
        self.last_task = task = self.scoring_task(base_pose, linear_mps, angular_radps, costmap, plan)
        linear_mps, angular_radps, cost, points = find_cheapest(task, costmap.origin, plan, base_pose)
        if cost == math.inf:
            return None
        self.oscillation.update(base_pose, linear_mps, angular_radps)
        return Trajectory(linear_mps, angular_radps, cost, points[:, :3])

    def is_collision_free(self, base_pose: Pose2D, linear_mps: float, angular_radps: float, costmap: Costmap) -> bool:
        """Return whether a constant velocity keeps the robot clear of obstacles over sim_time.

        Upstream also asks the critics of path and goal, with distances of an earlier cycle; for a turn in place at
        the goal only the obstacle critic means anything.
        """
        params, twist = self._rollout._replace(accelerates=False), (linear_mps, angular_radps)
        steps = step_count(params, *twist)
        points = np.empty((steps, 5))
        if steps > 0:
            roll_out(params, costmap.pose_in_grid(base_pose), twist, twist, steps, points)
        return bool(stays_clear(costmap.costs, costmap.cells_per_m, costmap.footprint.vertices_m, points))

    def scoring_task(
        self, base_pose: Pose2D, linear_mps: float, angular_radps: float, costmap: Costmap, plan: np.ndarray
    ) -> ScoringTask:
        """Return what `find_best` chooses from, before the waves have begun at the plan."""
        goal_m = math.hypot(plan[-1, 0] - base_pose.x_m, plan[-1, 1] - base_pose.y_m)
        return ScoringTask(
            self._window,
            self._rollout,
            self._scene(costmap, goal_m),
            costmap.pose_in_grid(base_pose),
            (linear_mps, angular_radps),
            goal_m,
            self.oscillation.allowed(),
        )

    def _scene(self, costmap: Costmap, goal_m: float) -> Scene:
        """Return what trajectories are scored against."""
        if self._waves_shape != costmap.shape:
            self._waves, self._waves_shape = make_waves(costmap.shape), costmap.shape
        params = self.params
        return Scene(
            costmap.costs,
            costmap.cells_per_m,
            costmap.footprint.vertices_m,
            self._waves,
            params.forward_point_distance,
            self._scales(costmap, goal_m),
            params.sum_scores,
        )

    def _scales(self, costmap: Costmap, goal_m: float) -> np.ndarray:
        """Return the weights (7,) of the critics; biases are per metre, distances in cells."""
        params = self.params
        path = params.path_distance_bias * costmap.resolution_m
        goal = params.goal_distance_bias * costmap.resolution_m
        # Close to the goal the nose has nothing to align with.
        is_far = goal_m**2 > params.forward_point_distance**2 * params.cheat_factor
        return np.array([1.0, params.occdist_scale, goal, path if is_far else 0.0, path, goal, params.twirling_scale])


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
