"""Dynamic window approach: the best of all velocities that the next control period can reach.

Fox, Burgard and Thrun, The dynamic window approach to collision avoidance, 1997, as dwa_local_planner implements it:
sample the window, roll each sample out into a trajectory, choose by the critics.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Optional

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.dwa_params import DwaParams
from diff_encoder_sim.navigation.dwa_search import ScoringTask, find_cheapest
from diff_encoder_sim.navigation.dynamic_window import window_params
from diff_encoder_sim.navigation.oscillation import OscillationMemory
from diff_encoder_sim.navigation.plan_distances import Waves, make_waves
from diff_encoder_sim.navigation.trajectory_rollout import roll_out, rollout_params, step_count
from diff_encoder_sim.navigation.trajectory_scoring import Scene, stays_clear


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
