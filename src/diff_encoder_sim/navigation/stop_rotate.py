"""Stop at the goal and turn to its heading: base_local_planner's LatchedStopRotateController."""

from __future__ import annotations

import math
from typing import Callable, NamedTuple, Optional, Tuple

from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.navigation.dwa_params import DwaParams

# Returns whether a command (linear [m/s], angular [rad/s]) keeps clear of obstacles.
ClearanceCheck = Callable[[float, float], bool]


class Motion(NamedTuple):
    """Pose and velocity of the robot, from odometry."""

    base_pose: Pose2D  # in the frame of the goal
    linear_mps: float
    angular_radps: float


class LatchedStopRotate:
    """Controls the robot instead of the DWA within xy_goal_tolerance of the goal."""

    def __init__(self, params: DwaParams, sim_period_s: float) -> None:
        self.params = params
        self._sim_period_s = sim_period_s
        self.reset()

    def reset(self) -> None:
        """Begin a new plan: the position is not latched and the robot is not turning."""
        self._is_latched = False
        self._is_rotating = False

    def is_position_reached(self, motion: Motion, goal: Pose2D) -> bool:
        """Return whether the robot is within tolerance, or was once and that is latched."""
        params = self.params
        distance_m = math.hypot(goal.x_m - motion.base_pose.x_m, goal.y_m - motion.base_pose.y_m)
        self._is_latched |= distance_m <= (1.0 - params.latch_margin) * params.xy_goal_tolerance
        if params.latch_xy_goal_tolerance:
            return self._is_latched
        return distance_m <= params.xy_goal_tolerance

    def is_goal_reached(self, motion: Motion, goal: Pose2D) -> bool:
        """Return whether the robot stands at the goal, position and heading within tolerance."""
        return (
            self.is_position_reached(motion, goal)
            and abs(self._remaining_turn(motion, goal)) <= self.params.yaw_goal_tolerance
            and self._is_stopped(motion)
        )

    def command(self, motion: Motion, goal: Pose2D, is_clear: ClearanceCheck) -> Optional[Tuple[float, float]]:
        """Return (linear [m/s], angular [rad/s]) to stop and then turn; None if that would collide."""
        turn_rad = self._remaining_turn(motion, goal)
        if self._has_turned(turn_rad, motion.angular_radps):
            self._is_rotating = False
            return 0.0, 0.0
        if not self._is_rotating and not self._is_stopped(motion):
            command = self._slow_down(motion)
        else:
            self._is_rotating = True
            command = 0.0, self._turning_speed(turn_rad, motion.angular_radps)
        return command if is_clear(*command) else None

    def _has_turned(self, turn_rad: float, _: float) -> bool:
        return abs(turn_rad) <= self.params.yaw_goal_tolerance

    @staticmethod
    def _remaining_turn(motion: Motion, goal: Pose2D) -> float:
        return wrap_angle(goal.yaw_rad - motion.base_pose.yaw_rad)

    def _is_stopped(self, motion: Motion) -> bool:
        return (
            abs(motion.linear_mps) <= self.params.trans_stopped_vel
            and abs(motion.angular_radps) <= self.params.theta_stopped_vel
        )

    def _slow_down(self, motion: Motion) -> Tuple[float, float]:
        """Return the command after one period of braking at the acceleration limits."""
        linear_mps = abs(motion.linear_mps) - self.params.acc_lim_x * self._sim_period_s
        angular_radps = abs(motion.angular_radps) - self.params.acc_lim_theta * self._sim_period_s
        return (
            math.copysign(max(0.0, linear_mps), motion.linear_mps),
            math.copysign(max(0.0, angular_radps), motion.angular_radps),
        )

    def _turning_speed(self, turn_rad: float, angular_radps: float) -> float:
        """Return the speed [rad/s] that ends the turn in a second, as far as it can be reached and stopped in time."""
        params = self.params
        change = params.acc_lim_theta * self._sim_period_s
        speed = self._within_limits(abs(turn_rad))
        speed = min(max(speed, abs(angular_radps) - change), abs(angular_radps) + change)
        speed = min(speed, math.sqrt(2.0 * params.acc_lim_theta * abs(turn_rad)))
        return math.copysign(self._within_limits(speed), turn_rad)

    def _within_limits(self, speed_radps: float) -> float:
        return min(self.params.max_vel_theta, max(self.params.min_vel_theta, speed_radps))
