"""The dynamic window approach: the best of all velocities that the next control period can reach.

Fox, Burgard and Thrun, The dynamic window approach to collision avoidance, 1997, as
dwa_local_planner implements it: sample the window, roll each sample out, let the critics judge.
"""
from __future__ import annotations

import math
from typing import NamedTuple, Optional

import numpy as np

from diff_encoder_sim.navigation import critics
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.dwa_params import DwaParams
from diff_encoder_sim.navigation.map_grid import plan_distance
from diff_encoder_sim.navigation.oscillation import OscillationMemory
from diff_encoder_sim.navigation.velocity_window import velocity_samples, velocity_window
from diff_encoder_sim.se2 import Pose2D


class Trajectory(NamedTuple):
    """The command that won, and where it leads."""

    linear_mps: float
    angular_radps: float
    cost: float           # weighted sum of the critics
    poses: np.ndarray     # (n, 3) x, y [m], yaw [rad] in the costmap's frame


class Scored(NamedTuple):
    """All samples of one cycle and what the critics said, for tests and for looking at."""

    samples: np.ndarray   # (n, 2) linear [m/s], angular [rad/s]
    scores: np.ndarray    # (n, 7) by critic, see critics.py
    totals: np.ndarray    # (n,) weighted sums, below zero where rejected
    best: int             # index, -1 for none


class DwaPlanner:
    """Chooses a velocity each control period; keeps only what it needs against oscillation."""

    def __init__(self, params: DwaParams, sim_period_s: float) -> None:
        """`sim_period_s`: the control period, 1 / controller_frequency [s]."""
        self.params = params
        self.sim_period_s = sim_period_s
        self.oscillation = OscillationMemory(params)
        self.last_scored: Optional[Scored] = None
        self._grids = np.empty((3, 0, 0), np.int32)   # cells to the plan, its end, the nose's goal
        self._simulation = np.array([params.sim_time, params.sim_granularity,
                                     params.angular_sim_granularity])
        self._limits = np.array([params.min_vel_trans, params.max_vel_trans, params.min_vel_theta,
                                 params.acc_lim_x, params.acc_lim_theta])

    def find_best(self, base_pose: Pose2D, linear_mps: float, angular_radps: float,
                  costmap: Costmap, plan: np.ndarray) -> Optional[Trajectory]:
        """The cheapest trajectory, or None when the critics reject all.

        Args:
            base_pose: the robot, in the costmap's frame.
            linear_mps, angular_radps: its twist, from odometry.
            costmap: the local one.
            plan: (n, 3) the part of the global plan in sight, in the costmap's frame; n > 0.
        """
        if not self._measure_distances(base_pose, costmap, plan):
            self.last_scored = None
            return None
        goal_m = math.hypot(plan[-1, 0] - base_pose.x_m, plan[-1, 1] - base_pose.y_m)
        window = velocity_window(self.params, linear_mps, angular_radps, self.sim_period_s, goal_m)
        samples = velocity_samples(window, self.params.vx_samples, self.params.vth_samples)
        scored = self._score(base_pose, linear_mps, angular_radps, costmap, samples,
                             self._scales(costmap, goal_m))
        self.last_scored = scored
        if scored.best < 0:
            return None
        trajectory = self._trajectory(base_pose, linear_mps, angular_radps, scored)
        self.oscillation.update(base_pose, trajectory.linear_mps, trajectory.angular_radps)
        return trajectory

    def is_collision_free(self, base_pose: Pose2D, linear_mps: float, angular_radps: float,
                          costmap: Costmap) -> bool:
        """Whether a constant velocity keeps the robot clear of obstacles over sim_time.

        Upstream also asks the critics of path and goal, with distances of an earlier cycle; for a
        turn on the spot at the goal only the obstacle critic means anything.
        """
        shape = costmap.costs.shape
        if self._grids.shape[1:] != shape:
            self._grids = np.zeros((3, *shape), np.int32)
        scales = np.zeros(critics.CRITICS)
        scales[critics.OBSTACLE] = 1.0
        scored = self._score(base_pose, linear_mps, angular_radps, costmap,
                             np.array([[linear_mps, angular_radps]]), scales, is_check=True)
        return bool(scored.totals[0] >= 0.0 or scored.totals[0] == critics.NO_TRAJECTORY)

    def _measure_distances(self, base_pose: Pose2D, costmap: Costmap, plan: np.ndarray) -> bool:
        if self._grids.shape[1:] != costmap.costs.shape:
            self._grids = np.empty((3, *costmap.costs.shape), np.int32)
        plan_m = _positions_in_grid(plan, costmap)
        front_m = plan_m.copy()
        # The nose's goal lies behind the goal as the robot sees it, not along the goal's
        # heading: that would swing around when the robot must turn at the end.
        base = costmap.pose_in_grid(base_pose)
        bearing_rad = math.atan2(plan_m[-1, 1] - base.y_m, plan_m[-1, 0] - base.x_m)
        front_m[-1] += self.params.forward_point_distance * np.array(
            [math.cos(bearing_rad), math.sin(bearing_rad)])
        costs, per_m = costmap.costs, costmap.cells_per_m
        return bool(plan_distance(costs, per_m, plan_m, False, self._grids[0])
                    and plan_distance(costs, per_m, plan_m, True, self._grids[1])
                    and plan_distance(costs, per_m, front_m, True, self._grids[2]))

    def _scales(self, costmap: Costmap, goal_m: float) -> np.ndarray:
        """(7,) weights of the critics; biases are per metre, distances in cells."""
        params = self.params
        path = params.path_distance_bias * costmap.resolution_m
        goal = params.goal_distance_bias * costmap.resolution_m
        # At the goal the nose has nothing to align with any more.
        is_far = goal_m ** 2 > params.forward_point_distance ** 2 * params.cheat_factor
        return np.array([1.0, params.occdist_scale, goal, path if is_far else 0.0, path, goal,
                         params.twirling_scale])

    def _score(self, base_pose: Pose2D, linear_mps: float, angular_radps: float, costmap: Costmap,
               samples: np.ndarray, scales: np.ndarray, is_check: bool = False) -> Scored:
        params = self.params
        scores, totals = np.zeros((len(samples), critics.CRITICS)), np.zeros(len(samples))
        limits = np.array([0.0, math.inf, 0.0, 0.0, 0.0]) if is_check else self._limits
        best = critics.score_samples(
            costmap.costs, costmap.cells_per_m, costmap.footprint.vertices_m,
            np.array(costmap.pose_in_grid(base_pose)), np.array([linear_mps, angular_radps]),
            samples, limits, self._simulation, not (params.use_dwa or is_check), self._grids[0],
            self._grids[1], self._grids[2], params.forward_point_distance, scales,
            params.sum_scores, np.full(4, True) if is_check else self.oscillation.allowed(),
            scores, totals)
        return Scored(samples, scores, totals, int(best))

    def _trajectory(self, base_pose: Pose2D, linear_mps: float, angular_radps: float,
                    scored: Scored) -> Trajectory:
        """The best sample's trajectory; without use_dwa its command is what one step reaches."""
        params, sample = self.params, scored.samples[scored.best]
        steps = critics.step_count(sample[0], sample[1], *self._simulation)
        poses = np.empty((steps, 3))
        critics.roll_out(np.array(base_pose), np.array([linear_mps, angular_radps]), sample, steps,
                         params.sim_time, self._limits[3:5], not params.use_dwa, poses)
        command = [float(value) for value in sample]
        if not params.use_dwa:
            interval_s = params.sim_time / steps
            command = [critics.approach(linear_mps, command[0], params.acc_lim_x * interval_s),
                       critics.approach(angular_radps, command[1],
                                        params.acc_lim_theta * interval_s)]
        return Trajectory(command[0], command[1], float(scored.totals[scored.best]), poses)


def _positions_in_grid(plan: np.ndarray, costmap: Costmap) -> np.ndarray:
    """(n, 2) x, y of a plan in the costmap's grid [m]."""
    origin = costmap.origin
    cos_yaw, sin_yaw = math.cos(origin.yaw_rad), math.sin(origin.yaw_rad)
    return (plan[:, :2] - (origin.x_m, origin.y_m)) @ np.array([[cos_yaw, -sin_yaw],
                                                               [sin_yaw, cos_yaw]])
