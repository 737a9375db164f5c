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
from diff_encoder_sim.navigation.critics import CRITICS
from diff_encoder_sim.navigation.dwa_params import DwaParams
from diff_encoder_sim.navigation.dynamic_window import dynamic_window, velocity_samples
from diff_encoder_sim.navigation.oscillation import OscillationMemory
from diff_encoder_sim.navigation.plan_distances import fill_distance_grids
from diff_encoder_sim.navigation.trajectory_rollout import approach, roll_out, roll_out_all, step_count
from diff_encoder_sim.navigation.trajectory_scoring import score_samples, stays_clear


class Trajectory(NamedTuple):
    """A chosen command and the trajectory it was chosen for."""

    linear_mps: float
    angular_radps: float
    cost: float  # weighted sum of the critics
    poses: np.ndarray  # (n, 3) x, y [m], yaw [rad] in the costmap's frame


class ScoringTask(NamedTuple):
    """Arguments of trajectory_scoring.score_samples."""

    costs: np.ndarray
    per_m: float
    vertices_m: np.ndarray
    grids: np.ndarray
    nose_m: float
    scales: np.ndarray
    sums_obstacle: bool
    samples: np.ndarray
    points: np.ndarray
    steps: np.ndarray
    allowed: np.ndarray
    scores: np.ndarray
    totals: np.ndarray


class DwaPlanner:
    """Chooses a velocity in each control period; remembers only what prevents oscillation.

    Args:
        params: limits, sampling and weights.
        sim_period_s: the control period, 1 / controller_frequency [s].
    """

    def __init__(self, params: DwaParams, sim_period_s: float) -> None:
        self.params = params
        self.sim_period_s = sim_period_s
        self.oscillation = OscillationMemory(params)
        self.last_task: Optional[ScoringTask] = None  # of the last `find_best`, for displays
        self._grids = np.empty((3, 0, 0), np.int32)  # of fill_distance_grids
        self._simulation = np.array([params.sim_time, params.sim_granularity, params.angular_sim_granularity])
        self._limits = np.array([params.min_vel_trans, params.max_vel_trans, params.min_vel_theta])
        self._accelerations = np.array([params.acc_lim_x, params.acc_lim_theta])

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
        if task is None:
            return None
        best = score_samples(*task)
        if best < 0:
            return None
        twist, cost = np.array([linear_mps, angular_radps]), float(task.totals[best])
        trajectory = self._trajectory(base_pose, twist, task.samples[best], cost)
        self.oscillation.update(base_pose, trajectory.linear_mps, trajectory.angular_radps)
        return trajectory

    def is_collision_free(self, base_pose: Pose2D, linear_mps: float, angular_radps: float, costmap: Costmap) -> bool:
        """Return whether a constant velocity keeps the robot clear of obstacles over sim_time.

        Upstream also asks the critics of path and goal, with distances of an earlier cycle; for a turn in place at
        the goal only the obstacle critic means anything.
        """
        twist = np.array([linear_mps, angular_radps])
        points = self._roll_out(costmap.pose_in_grid(base_pose), twist, twist, False)
        return bool(stays_clear(costmap.costs, costmap.cells_per_m, costmap.footprint.vertices_m, points))

    def scoring_task(
        self, base_pose: Pose2D, linear_mps: float, angular_radps: float, costmap: Costmap, plan: np.ndarray
    ) -> Optional[ScoringTask]:
        """Return the samples of `find_best` and what they are scored by; None if the plan is off the costmap."""
        if self._grids.shape[1:] != costmap.shape:
            self._grids = np.empty((3, *costmap.shape), np.int32)
        params, costs, per_m = self.params, costmap.costs, costmap.cells_per_m
        pose, nose_m = np.array(costmap.pose_in_grid(base_pose)), params.forward_point_distance
        if not fill_distance_grids(costs, per_m, np.array(costmap.origin), plan, pose, nose_m, self._grids):
            return None
        goal_m = math.hypot(plan[-1, 0] - base_pose.x_m, plan[-1, 1] - base_pose.y_m)
        window = dynamic_window(params, linear_mps, angular_radps, self.sim_period_s, goal_m)
        samples = velocity_samples(window, params.vx_samples, params.vth_samples)
        twist, accelerates = np.array([linear_mps, angular_radps]), not params.use_dwa
        points, steps = roll_out_all(
            pose, twist, samples, self._simulation, self._limits, self._accelerations, accelerates
        )
        scene = costs, per_m, costmap.footprint.vertices_m, self._grids, nose_m, self._scales(costmap, goal_m)
        scores, totals = np.empty((len(samples), CRITICS)), np.empty(len(samples))
        return ScoringTask(
            *scene, params.sum_scores, samples, points, steps, self.oscillation.allowed(), scores, totals
        )

    def _scales(self, costmap: Costmap, goal_m: float) -> np.ndarray:
        """Return the weights (7,) of the critics; biases are per metre, distances in cells."""
        params = self.params
        path = params.path_distance_bias * costmap.resolution_m
        goal = params.goal_distance_bias * costmap.resolution_m
        # Close to the goal the nose has nothing to align with.
        is_far = goal_m**2 > params.forward_point_distance**2 * params.cheat_factor
        return np.array([1.0, params.occdist_scale, goal, path if is_far else 0.0, path, goal, params.twirling_scale])

    def _trajectory(self, base_pose: Pose2D, twist: np.ndarray, sample: np.ndarray, cost: float) -> Trajectory:
        """Return a sample's trajectory; without use_dwa its command is what the first step reaches."""
        params, (linear_mps, angular_radps) = self.params, sample.tolist()
        poses = self._roll_out(base_pose, twist, sample, not params.use_dwa)
        if not params.use_dwa:
            interval_s = params.sim_time / len(poses)
            linear_mps = approach(twist[0], linear_mps, params.acc_lim_x * interval_s)
            angular_radps = approach(twist[1], angular_radps, params.acc_lim_theta * interval_s)
        return Trajectory(linear_mps, angular_radps, cost, poses)

    def _roll_out(self, start: Pose2D, twist: np.ndarray, sample: np.ndarray, accelerates: bool) -> np.ndarray:
        """Return the points (n, 3) of one trajectory, none for zero velocity."""
        pose, steps = np.array(start), step_count(sample[0], sample[1], *self._simulation)
        poses = np.empty((steps, 3))
        if steps > 0:
            roll_out(pose, twist, sample, steps, self.params.sim_time, self._accelerations, accelerates, poses)
        return poses
