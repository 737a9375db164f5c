"""Local planner: follow the part of the global plan in the local costmap, by DWA or by stop and rotate."""

from __future__ import annotations

from typing import Optional, Tuple

import numpy as np

from diff_encoder_sim.base.kernels import Array, compiled
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, transform_points
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.dwa import DwaPlanner, Trajectory
from diff_encoder_sim.navigation.dwa_params import DwaParams
from diff_encoder_sim.navigation.goal_stopping import LatchedStopRotate, Motion, PreciseStop, TurnToPath
from diff_encoder_sim.navigation.navigator_inputs import Command, OdometrySample

# Points of the plan farther behind the robot are dropped (upstream's prunePlan).
PRUNE_DISTANCE_M = 1.0

NO_POSES = np.empty((0, 3))


class LocalPlanner:
    """Follows a plan given in the map frame, planning in the odom frame (DWAPlannerROS)."""

    def __init__(self, params: DwaParams, sim_period_s: float) -> None:
        self.params = params
        self.dwa = DwaPlanner(params, sim_period_s)
        stop = PreciseStop if params.stop == 'precise' else LatchedStopRotate
        self._stop_rotate: LatchedStopRotate = stop(params, sim_period_s)
        self._turn_to_path = TurnToPath(params, sim_period_s)
        self._plan_in_map = self._whole_in_odom = NO_POSES
        self._goal_in_odom = IDENTITY
        self._odom_pose_in_map: Optional[Pose2D] = None  # by which these were transformed
        self.problem = ''  # why the last `compute` returned None
        self.plan_in_odom = NO_POSES  # the stretch that is followed, for displays

    def set_plan(self, plan_in_map: np.ndarray, is_renewed: bool = False) -> None:
        """Follow a new plan (n, 3), n > 0; latched tolerances, turns and locked directions are reset.

        With `is_renewed`, for the same goal, a precise stop continues; upstream restarts.
        """
        self._plan_in_map, self._odom_pose_in_map = plan_in_map, None
        if not (is_renewed and self.params.stop == 'precise'):
            self._stop_rotate.reset()
        self._turn_to_path.reset()
        self.dwa.oscillation.reset()

    def is_goal_reached(self, odometry: OdometrySample, odom_pose_in_map: Pose2D) -> bool:
        """Return whether the robot stands at the plan's end within the tolerances."""
        self._transform_plan(odom_pose_in_map)
        return self._stop_rotate.is_goal_reached(Motion(*odometry[1:4]), self._goal_in_odom)

    def compute(
        self, odometry: OdometrySample, command: Command, odom_pose_in_map: Pose2D, costmap: Costmap
    ) -> Optional[Trajectory]:
        """Return the command for the next control period, with its trajectory; None if there is none (see `problem`).

        The trajectory is empty during turns.

        Args:
            odometry: the robot in the odom frame.
            command: the last one.
            odom_pose_in_map: from localization.
            costmap: the local costmap, in the odom frame.
        """
        self._transform_plan(odom_pose_in_map)
        motion = limited_motion(odometry, command, self.params.twist_sigmas)
        self.plan_in_odom = plan = self._visible_plan(motion.base_pose, odom_pose_in_map, costmap)
        if len(plan) == 0:
            self.problem = 'the plan is outside the local costmap'
            return None

        def is_clear(linear_mps: float, angular_radps: float) -> bool:
            return self.dwa.is_collision_free(motion.base_pose, linear_mps, angular_radps, costmap)

        if self._stop_rotate.is_position_reached(motion, self._goal_in_odom):
            turn = self._stop_rotate.command(motion, self._goal_in_odom, is_clear)
            self.problem = 'turning at the goal would collide'
            return turn and Trajectory(*turn, 0.0, NO_POSES)
        turn = self._turn_to_path.command(motion, plan, is_clear)
        self.problem = 'no velocity follows the plan without a collision'
        return Trajectory(*turn, 0.0, NO_POSES) if turn else self.dwa.find_best(*motion, costmap, plan)

    def _transform_plan(self, odom_pose_in_map: Pose2D) -> None:
        """Bring plan and goal into the odom frame if that has moved; yaw is not wrapped."""
        if odom_pose_in_map != self._odom_pose_in_map:
            self._odom_pose_in_map, plan, frame = odom_pose_in_map, self._plan_in_map, odom_pose_in_map.inverse()
            self._whole_in_odom = np.column_stack([transform_points(frame, plan[:, :2]), plan[:, 2] + frame.yaw_rad])
            self._goal_in_odom = Pose2D(*plan[-1].tolist()).relative_to(odom_pose_in_map)

    def _visible_plan(self, base_pose: Pose2D, odom_pose_in_map: Pose2D, costmap: Costmap) -> np.ndarray:
        """Return the first stretch (n, 3) of the plan that is about inside the local costmap, in odom."""
        base, sight_m = odom_pose_in_map.compose(base_pose), 0.5 * max(costmap.shape) * costmap.resolution_m
        prune_m = PRUNE_DISTANCE_M if self.params.prune_plan else 0.0
        first, last = visible_stretch(self._plan_in_map, base.x_m, base.y_m, sight_m, prune_m)
        visible = self._whole_in_odom[first:last]
        if self.params.prune_plan and len(visible) > 0:
            self._plan_in_map = self._plan_in_map[first:]
            self._whole_in_odom = self._whole_in_odom[first:]
        return visible


def limited_motion(odometry: OdometrySample, command: Command, sigmas: float) -> Motion:
    """Return odometry's pose and the last command's twist, limited to `sigmas` standard deviations around odometry's.

    An encoder of 40 pulses at 20 Hz measures a wheel's speed to +-0.31 m/s. Without the limit, a pulse of only one
    wheel centres the dynamic window on a sharp turn that does not exist, and the next command is that turn
    (docs/adr/0007-coarse-twist.md).
    """
    linear_mps, linear_band = odometry.linear_mps, sigmas * odometry.linear_std_mps
    angular_radps, angular_band = odometry.angular_radps, sigmas * odometry.angular_std_radps
    return Motion(
        odometry.base_pose_in_odom,
        min(max(command.linear_mps, linear_mps - linear_band), linear_mps + linear_band),
        min(max(command.angular_radps, angular_radps - angular_band), angular_radps + angular_band),
    )


@compiled
def visible_stretch(plan: Array, x_m: float, y_m: float, sight_m: float, prune_m: float) -> Tuple[int, int]:
    """Return the first of a plan's points (n, 3) to follow from a place and the one behind the last; (0, 0) for none.

    From the first within `sight_m`, or the first after it within `prune_m`, to the first beyond `sight_m` again,
    inclusive, so that the stretch reaches the window's edge.
    """
    distance_m = np.hypot(plan[:, 0] - x_m, plan[:, 1] - y_m)
    first = 0
    while first < len(plan) and distance_m[first] > sight_m:
        first += 1
    if first == len(plan):
        return 0, 0
    near = first
    while near < len(plan) and distance_m[near] >= prune_m:
        near += 1
    if near < len(plan):
        first = near
    last = first
    while last < len(plan) and distance_m[last] <= sight_m:
        last += 1
    return first, min(last + 1, len(plan))
