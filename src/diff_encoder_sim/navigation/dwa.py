"""The dynamic window approach: the best of all velocities that the next control period can reach.

Fox, Burgard and Thrun, The dynamic window approach to collision avoidance, 1997, as
dwa_local_planner implements it: sample the window, roll each sample out, let the critics judge.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Optional

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.navigation import critics
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.dwa_params import DwaParams
from diff_encoder_sim.navigation.dynamic_window import dynamic_window, velocity_samples
from diff_encoder_sim.navigation.oscillation import OscillationMemory
from diff_encoder_sim.navigation.plan_distances import plan_distances
from diff_encoder_sim.navigation.trajectory_rollout import approach, roll_out, roll_out_all, step_count
from diff_encoder_sim.navigation.trajectory_scoring import score_samples, stays_clear


class Trajectory(NamedTuple):
    """The command that won, and where it leads."""

    linear_mps: float
    angular_radps: float
    cost: float  # weighted sum of the critics
    poses: np.ndarray  # (n, 3) x, y [m], yaw [rad] in the costmap's frame


class Scored(NamedTuple):
    """All samples of one cycle and what the critics said, for tests and for looking at."""

    samples: np.ndarray  # (n, 2) linear [m/s], angular [rad/s]
    scores: np.ndarray  # (n, 7) by critic, see critics.py; incomplete where rejected
    totals: np.ndarray  # (n,) weighted sums, below zero where rejected
    best: int  # index, -1 for none


class DwaPlanner:
    """Chooses a velocity each control period; keeps only what it needs against oscillation."""

    def __init__(self, params: DwaParams, sim_period_s: float) -> None:
        """`sim_period_s`: the control period, 1 / controller_frequency [s]."""
        self.params = params
        self.sim_period_s = sim_period_s
        self.oscillation = OscillationMemory(params)
        self._grids = np.empty((3, 0, 0), np.int32)  # of plan_distances
        self._simulation = np.array([params.sim_time, params.sim_granularity, params.angular_sim_granularity])
        self._limits = np.array([params.min_vel_trans, params.max_vel_trans, params.min_vel_theta])
        self._accelerations = np.array([params.acc_lim_x, params.acc_lim_theta])

    def find_best(
        self, base_pose: Pose2D, linear_mps: float, angular_radps: float, costmap: Costmap, plan: np.ndarray
    ) -> Optional[Trajectory]:
        """The cheapest trajectory, or None when the critics reject all.

        Args:
            base_pose: the robot, in the costmap's frame.
            linear_mps, angular_radps: its twist, from odometry.
            costmap: the local one.
            plan: (n, 3) the part of the global plan in sight, in the costmap's frame; n > 0.
        """
        scored = self._score(base_pose, linear_mps, angular_radps, costmap, plan, False)
        if scored is None or scored.best < 0:
            return None
        trajectory = self._trajectory(base_pose, linear_mps, angular_radps, scored)
        self.oscillation.update(base_pose, trajectory.linear_mps, trajectory.angular_radps)
        return trajectory

    def score_all(
        self, base_pose: Pose2D, linear_mps: float, angular_radps: float, costmap: Costmap, plan: np.ndarray
    ) -> Optional[Scored]:
        """All samples as `find_best` would judge them, had it to; None if the plan is off the map.

        Arguments as there. `find_best` leaves those out that cannot win.
        """
        return self._score(base_pose, linear_mps, angular_radps, costmap, plan, True)

    def is_collision_free(self, base_pose: Pose2D, linear_mps: float, angular_radps: float, costmap: Costmap) -> bool:
        """Whether a constant velocity keeps the robot clear of obstacles over sim_time.

        Upstream also asks the critics of path and goal, with distances of an earlier cycle; for a
        turn on the spot at the goal only the obstacle critic means anything.
        """
        twist = np.array([linear_mps, angular_radps])
        points = self._roll_out(costmap.pose_in_grid(base_pose), twist, twist, False)
        return bool(stays_clear(costmap.costs, costmap.cells_per_m, costmap.footprint.vertices_m, points))

    def _score(
        self,
        base_pose: Pose2D,
        linear_mps: float,
        angular_radps: float,
        costmap: Costmap,
        plan: np.ndarray,
        scores_all: bool,
    ) -> Optional[Scored]:
        if self._grids.shape[1:] != costmap.shape:
            self._grids = np.empty((3, *costmap.shape), np.int32)
        params, costs, per_m = self.params, costmap.costs, costmap.cells_per_m
        pose, nose_m = np.array(costmap.pose_in_grid(base_pose)), params.forward_point_distance
        if not plan_distances(costs, per_m, np.array(costmap.origin), plan, pose, nose_m, self._grids):
            return None
        goal_m = math.hypot(plan[-1, 0] - base_pose.x_m, plan[-1, 1] - base_pose.y_m)
        window = dynamic_window(params, linear_mps, angular_radps, self.sim_period_s, goal_m)
        samples = velocity_samples(window, params.vx_samples, params.vth_samples)
        points, steps = roll_out_all(
            pose,
            np.array([linear_mps, angular_radps]),
            samples,
            self._simulation,
            self._limits,
            self._accelerations,
            not params.use_dwa,
        )
        scores, totals = np.empty((len(samples), critics.CRITICS)), np.empty(len(samples))
        best = score_samples(
            costs,
            per_m,
            costmap.footprint.vertices_m,
            self._grids,
            nose_m,
            self._scales(costmap, goal_m),
            params.sum_scores,
            samples,
            points,
            steps,
            self.oscillation.allowed(),
            scores_all,
            scores,
            totals,
        )
        return Scored(samples, scores, totals, best)

    def _scales(self, costmap: Costmap, goal_m: float) -> np.ndarray:
        """(7,) weights of the critics; biases are per metre, distances in cells."""
        params = self.params
        path = params.path_distance_bias * costmap.resolution_m
        goal = params.goal_distance_bias * costmap.resolution_m
        # At the goal the nose has nothing to align with any more.
        is_far = goal_m**2 > params.forward_point_distance**2 * params.cheat_factor
        return np.array([1.0, params.occdist_scale, goal, path if is_far else 0.0, path, goal, params.twirling_scale])

    def _trajectory(self, base_pose: Pose2D, linear_mps: float, angular_radps: float, scored: Scored) -> Trajectory:
        """The best sample's trajectory; without use_dwa its command is what one step reaches."""
        params, sample = self.params, scored.samples[scored.best]
        poses = self._roll_out(base_pose, np.array([linear_mps, angular_radps]), sample, not params.use_dwa)
        command = sample.tolist()
        if not params.use_dwa:
            interval_s = params.sim_time / len(poses)
            command = [
                approach(linear_mps, command[0], params.acc_lim_x * interval_s),
                approach(angular_radps, command[1], params.acc_lim_theta * interval_s),
            ]
        return Trajectory(command[0], command[1], float(scored.totals[scored.best]), poses)

    def _roll_out(self, start: Pose2D, twist: np.ndarray, sample: np.ndarray, accelerates: bool) -> np.ndarray:
        """(n, 3) points of one trajectory; none of a stand."""
        poses = np.empty((step_count(sample[0], sample[1], *self._simulation), 3))
        if len(poses) > 0:
            roll_out(
                np.array(start),
                twist,
                sample,
                len(poses),
                self.params.sim_time,
                self._accelerations,
                accelerates,
                poses,
            )
        return poses
