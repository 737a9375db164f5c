"""Dynamic window approach: the best of all velocities that the next control period can reach.

Fox, Burgard and Thrun, The dynamic window approach to collision avoidance, 1997, as dwa_local_planner implements it:
sample the window, roll each sample out into a trajectory, choose by the critics.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.base.kernels import Array, compiled
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, transform_points, wrap_angle
from diff_encoder_sim.navigation import dwa_kernels as kernels
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.costmap_params import INSCRIBED
from diff_encoder_sim.navigation.goal_stopping import LatchedStopRotate, Motion, PreciseStop, TurnToPath
from diff_encoder_sim.navigation.navigator_inputs import Command, OdometrySample
from diff_encoder_sim.navigation.navigator_params import DwaParams


class OscillationMemory:
    """Directions that past commands exclude until the robot has moved away from its last reversal."""

    def __init__(self, params: DwaParams) -> None:
        self._params = params
        self.reset()

    def reset(self) -> None:
        """Allow all directions: of both velocities, the last sign and the only allowed one are 0 for none."""
        self._last_signs, self._only_signs = [0, 0], [0, 0]
        self._reversed_at: Optional[Pose2D] = None

    def allowed(self) -> Tuple[bool, bool, bool, bool]:
        """Return whether forward, backward, left and right are allowed."""
        linear, angular = self._only_signs
        return linear != -1, linear != 1, angular != -1, angular != 1

    def update(self, base_pose: Pose2D, linear_mps: float, angular_radps: float) -> None:
        """Enter the command that was chosen at a pose."""
        params = self._params
        # A robot that drives on may weave: turns count only (nearly) in place.
        is_driving = abs(linear_mps) > params.min_vel_trans
        for axis, velocity in enumerate((linear_mps,) if is_driving else (linear_mps, angular_radps)):
            sign = (velocity > 0.0) - (velocity < 0.0)
            if sign and self._last_signs[axis] == -sign:
                self._only_signs[axis], self._reversed_at = sign, base_pose
            self._last_signs[axis] = sign or self._last_signs[axis]
        since = self._reversed_at
        if since is not None:
            squared_m = (base_pose.x_m - since.x_m) ** 2 + (base_pose.y_m - since.y_m) ** 2
            turned_rad = abs(wrap_angle(base_pose.yaw_rad - since.yaw_rad))
            if squared_m > params.oscillation_reset_dist**2 or turned_rad > params.oscillation_reset_angle:
                self.reset()


class Trajectory(NamedTuple):
    """A chosen command and the trajectory it was chosen for."""

    linear_mps: float
    angular_radps: float
    cost: float  # weighted sum of the critics
    poses: np.ndarray  # (n, 3) x, y [m], yaw [rad] in the costmap's frame


class DwaPlanner:
    """Chooses a velocity in each control period of `sim_period_s` [s]."""

    def __init__(self, params: DwaParams, sim_period_s: float) -> None:
        self.params = params
        self.oscillation = OscillationMemory(params)
        self.last_task: Optional[kernels.ScoringTask] = None  # of the last `find_best`, for displays
        horizon_s = sim_period_s if params.use_dwa else params.sim_time
        limits = [getattr(params, name) for name in kernels.DwaLimits._fields[:-1]]
        self._limits = kernels.DwaLimits._make([*limits, horizon_s])
        self._constant_velocity = self._limits._replace(use_dwa=True)
        self._waves_shape, self._waves = (0, 0), kernels.make_waves(0, 0)

    def find_best(
        self, base_pose: Pose2D, linear_mps: float, angular_radps: float, costmap: Costmap, plan: np.ndarray
    ) -> Optional[Trajectory]:
        """Return the cheapest trajectory, or None if the critics reject all.

        Robot and plan (n, 3), n > 0, the stretch of the global plan to follow, are in the local costmap's frame.
        """
        self.last_task = task = self.scoring_task(base_pose, linear_mps, angular_radps, costmap, plan)
        linear_mps, angular_radps, cost, points = kernels.find_cheapest(task, costmap.origin, plan, base_pose)
        if cost == math.inf:
            return None
        self.oscillation.update(base_pose, linear_mps, angular_radps)
        return Trajectory(linear_mps, angular_radps, cost, points[:, :3])

    def is_collision_free(self, base_pose: Pose2D, linear_mps: float, angular_radps: float, costmap: Costmap) -> bool:
        """Return whether a constant velocity keeps the robot clear of obstacles over sim_time."""
        place = costmap.costs, costmap.cells_per_m, costmap.footprint.vertices_m, costmap.pose_in_grid(base_pose)
        return bool(kernels.stays_clear(self._constant_velocity, *place, (linear_mps, angular_radps)))

    def scoring_task(
        self, base_pose: Pose2D, linear_mps: float, angular_radps: float, costmap: Costmap, plan: np.ndarray
    ) -> kernels.ScoringTask:
        """Return what `find_best` chooses from, before the waves have begun at the plan."""
        if self._waves_shape != costmap.shape:
            self._waves_shape, self._waves = costmap.shape, kernels.make_waves(*costmap.shape)
        params, goal_x_m, goal_y_m = self.params, float(plan[-1, 0]), float(plan[-1, 1])
        goal_m = math.hypot(goal_x_m - base_pose.x_m, goal_y_m - base_pose.y_m)
        # Biases are per metre, distances in cells. Close to the goal the nose has nothing to align with.
        path = params.path_distance_bias * costmap.resolution_m
        goal = params.goal_distance_bias * costmap.resolution_m
        is_far = goal_m**2 > params.forward_point_distance**2 * params.cheat_factor
        scales = np.array([params.occdist_scale, goal, path if is_far else 0.0, path, goal, params.twirling_scale])
        grid = costmap.costs, costmap.cells_per_m, costmap.footprint.vertices_m, *self._waves
        motion = costmap.pose_in_grid(base_pose), (linear_mps, angular_radps)
        return kernels.ScoringTask(self._limits, *grid, scales, *motion, goal_m, self.oscillation.allowed())


TRAJECTORY_FIELDS = ('x', 'y', 'z', 'theta', 'cost')
COST_FIELDS = ('x', 'y', 'z', 'path_cost', 'goal_cost', 'occ_cost', 'total_cost')


def trajectory_cloud(task: kernels.ScoringTask, origin: Pose2D) -> np.ndarray:
    """Return the points (n, 5), TRAJECTORY_FIELDS, of all accepted trajectories in the frame of the grid's origin."""
    _, steps, all_points, totals = kernels.score_all(task)
    accepted = np.flatnonzero(totals >= 0.0)
    if len(accepted) == 0:
        return np.empty((0, len(TRAJECTORY_FIELDS)))
    points = np.concatenate([all_points[index, : steps[index]] for index in accepted])
    placed = transform_points(origin, points[:, :2])
    costs = np.repeat(totals[accepted], steps[accepted])
    return np.column_stack([placed, np.zeros(len(points)), points[:, 2] + origin.yaw_rad, costs])


def cost_cloud(task: kernels.ScoringTask, origin: Pose2D) -> np.ndarray:
    """Return the centres (n, 7), COST_FIELDS, of cells that the robot's centre can reach; distances are in cells."""
    to_plan, to_end = kernels.whole_grid(task, kernels.TO_PLAN), kernels.whole_grid(task, kernels.TO_END)
    rows, columns = np.nonzero((to_plan < to_plan.size) & (task.costs < INSCRIBED))
    centres = transform_points(origin, (np.column_stack([columns, rows]) + 0.5) / task.per_m)
    path, goal, obstacle = to_plan[rows, columns], to_end[rows, columns], task.costs[rows, columns]
    path_scale, goal_scale, obstacle_scale = task.scales[[kernels.PATH, kernels.GOAL, kernels.OBSTACLE]]
    total = path_scale * path + goal_scale * goal + obstacle_scale * obstacle
    return np.column_stack([centres, np.zeros(len(rows)), path, goal, obstacle, total])


PRUNE_DISTANCE_M = 1.0  # points of the plan farther behind the robot are dropped: upstream's prunePlan
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
        """Follow a new plan (n, 3), n > 0; if it `is_renewed`, for the same goal, a precise stop continues."""
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

        `command` is the last one, `costmap` the local one, in the odom frame. The trajectory is empty during turns.
        """
        self._transform_plan(odom_pose_in_map)
        motion = limited_motion(odometry, command, self.params.twist_sigmas)
        base, sight_m = odom_pose_in_map.compose(motion.base_pose), 0.5 * max(costmap.shape) * costmap.resolution_m
        prune_m = PRUNE_DISTANCE_M if self.params.prune_plan else 0.0
        first, end = visible_stretch(self._plan_in_map, base.x_m, base.y_m, sight_m, prune_m)
        self.plan_in_odom = plan = self._whole_in_odom[first:end]
        if self.params.prune_plan:  # (0, 0) if no point is visible
            self._plan_in_map, self._whole_in_odom = self._plan_in_map[first:], self._whole_in_odom[first:]
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


def limited_motion(odometry: OdometrySample, command: Command, sigmas: float) -> Motion:
    """Return odometry's pose, and the last command within `sigmas` of its twist (docs/adr/0007-coarse-twist.md)."""
    parts = zip(command, odometry[2:4], odometry[4:6])
    twist = (min(max(sent, now - sigmas * std), now + sigmas * std) for sent, now, std in parts)
    return Motion(odometry.base_pose_in_odom, *twist)


@compiled
def visible_stretch(plan: Array, x_m: float, y_m: float, sight_m: float, prune_m: float) -> Tuple[int, int]:
    """Return the first of a plan's points (n, 3) to follow from a place and the one behind the last; (0, 0) for none.

    From the first within `sight_m`, or the first after it within `prune_m`, to the first beyond `sight_m` again,
    inclusive, so that the stretch reaches the window's edge.
    """
    first = near = -1
    for index in range(len(plan)):
        distance_m = math.hypot(plan[index, 0] - x_m, plan[index, 1] - y_m)
        if first < 0 and distance_m <= sight_m:
            first = index
        if first >= 0 and distance_m < prune_m:
            near = index
            break
    if first < 0:
        return 0, 0
    first = max(first, near)
    for index in range(first, len(plan)):
        if math.hypot(plan[index, 0] - x_m, plan[index, 1] - y_m) > sight_m:
            return first, index + 1
    return first, len(plan)
