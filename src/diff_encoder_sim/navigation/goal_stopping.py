"""Stopping at the goal and turning in place, also as a recovery behaviour."""

from __future__ import annotations

import math
from typing import Callable, Dict, Mapping, NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.base.kernels import Array, compiled
from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.navigator_params import DwaParams

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
        self.params, self._sim_period_s = params, sim_period_s
        self.reset()

    def reset(self) -> None:
        """Reset for a new plan: position not latched, no turn."""
        self._is_latched = self._is_rotating = False

    def is_position_reached(self, motion: Motion, goal: Pose2D) -> bool:
        """Return whether the robot is within tolerance, or has latched the position."""
        params, distance_m = self.params, _distance_m(motion, goal)
        self._is_latched |= distance_m <= (1.0 - params.latch_margin) * params.xy_goal_tolerance
        return self._is_latched if params.latch_xy_goal_tolerance else distance_m <= params.xy_goal_tolerance

    def is_goal_reached(self, motion: Motion, goal: Pose2D) -> bool:
        """Return whether the robot has stopped at the goal, with position and heading within tolerance."""
        is_here = self.is_position_reached(motion, goal) and self._is_stopped(motion)
        return is_here and abs(_turn_left(motion, goal)) <= self.params.yaw_goal_tolerance

    def command(self, motion: Motion, goal: Pose2D, is_clear: ClearanceCheck) -> Optional[Tuple[float, float]]:
        """Return (linear [m/s], angular [rad/s]) to stop and then turn; None if that would collide."""
        turn_rad = _turn_left(motion, goal)
        if self._has_turned(turn_rad, motion.angular_radps):
            self._is_rotating = False
            return 0.0, 0.0
        if self._is_rotating or self._is_stopped(motion):
            self._is_rotating = True
            command = 0.0, self._turning_speed(turn_rad, motion.angular_radps)
        else:  # brake
            limits = (motion.linear_mps, self.params.acc_lim_x), (motion.angular_radps, self.params.acc_lim_theta)
            linear_mps, angular_radps = (math.copysign(self._reachable(0.0, abs(v), a), v) for v, a in limits)
            command = linear_mps, angular_radps
        return command if is_clear(*command) else None

    def _has_turned(self, turn_rad: float, _: float) -> bool:
        return abs(turn_rad) <= self.params.yaw_goal_tolerance

    def _is_stopped(self, motion: Motion) -> bool:
        is_standing = abs(motion.linear_mps) <= self.params.trans_stopped_vel
        return is_standing and abs(motion.angular_radps) <= self.params.theta_stopped_vel

    def _turning_speed(self, turn_rad: float, angular_radps: float) -> float:
        """Return the speed [rad/s] that ends the turn in a second, within the acceleration limits."""
        lowest, highest, most = self.params.min_vel_theta, self.params.max_vel_theta, self.params.acc_lim_theta
        speed = self._reachable(min(highest, max(lowest, abs(turn_rad))), abs(angular_radps), most)
        speed = min(speed, math.sqrt(2.0 * most * abs(turn_rad)))
        return math.copysign(min(highest, max(lowest, speed)), turn_rad)

    def _reachable(self, velocity: float, now: float, acceleration: float) -> float:
        change = acceleration * self._sim_period_s
        return min(max(velocity, now - change), now + change)


def _turn_left(motion: Motion, goal: Pose2D) -> float:
    """Return the remaining rotation to the goal's heading [rad]."""
    return wrap_angle(goal.yaw_rad - motion.base_pose.yaw_rad)


def _distance_m(motion: Motion, goal: Pose2D) -> float:
    return math.hypot(goal.x_m - motion.base_pose.x_m, goal.y_m - motion.base_pose.y_m)


# Fractions of a tolerance: smaller errors are not corrected, as less than half a pulse would increase the error.
SET_OUT = 1.0 / 3.0
NEAR = 0.1  # a smaller lateral offset is not steered to, and the robot does not slow down further
ASIDE_RAD = math.radians(45.0)  # a robot within the tolerance turns to a goal at a larger bearing: it has passed it
LAG_PERIODS = 2.0  # from a pose to the end of its command: one of the command, one for the transport of both


class PreciseStop(LatchedStopRotate):
    """Drives from the edge of the tolerance to the position closest to the goal, then turns to its heading.

    It never drives backwards. If it started within the tolerance, it corrects lateral offsets only by steering.
    Position and heading are latched when they are first reached or passed: jumps of a pulse do not start a search.
    """

    def reset(self) -> None:
        """Reset for a new plan."""
        super().reset()
        self._is_within_tolerance = self._is_approaching = self._has_arrived = self._is_aligned = False
        self._has_begun_here: Optional[bool] = None  # within the tolerance; None before the first pose
        self._turn_began_rad = 0.0  # remaining rotation at the start of the turn

    def is_position_reached(self, motion: Motion, goal: Pose2D) -> bool:
        """Return whether the robot is within tolerance, or has latched its arrival."""
        if self._has_arrived and self.params.latch_xy_goal_tolerance:
            return True
        margin = 0.0 if self._is_within_tolerance else self.params.latch_margin
        self._is_within_tolerance = _distance_m(motion, goal) <= (1.0 - margin) * self.params.xy_goal_tolerance
        if self._has_begun_here is None:
            self._has_begun_here = self._is_within_tolerance
        self._is_approaching &= self._is_within_tolerance
        self._has_arrived &= self._is_within_tolerance
        return self._is_within_tolerance

    def is_goal_reached(self, motion: Motion, goal: Pose2D) -> bool:
        """Return whether the robot has stopped at its closest position, with the goal's heading."""
        return super().is_goal_reached(motion, goal) and self._has_arrived and self._is_aligned

    def command(self, motion: Motion, goal: Pose2D, is_clear: ClearanceCheck) -> Optional[Tuple[float, float]]:
        """Return (linear [m/s], angular [rad/s]) to approach, stop and turn; None if the turn would collide."""
        if not self._has_arrived:
            approach = self._approach(motion, goal, is_clear)
            if approach is not None:
                return approach
            self._has_arrived = True
        turn = super().command(motion, goal, is_clear)
        if turn is None and abs(_turn_left(motion, goal)) <= self.params.yaw_goal_tolerance:
            self._is_aligned = True
            return 0.0, 0.0
        return turn

    def _approach(self, motion: Motion, goal: Pose2D, is_clear: ClearanceCheck) -> Optional[Tuple[float, float]]:
        """Return the command to the position closest to the goal; None if reached or blocked."""
        params, (ahead_m, left_m, _) = self.params, goal.relative_to(motion.base_pose)
        turn_rad = math.atan2(left_m, ahead_m)
        if self._is_approaching:
            is_here = ahead_m <= stopping_rest(motion.linear_mps, params.acc_lim_x, self._sim_period_s)
        else:
            is_here = math.hypot(ahead_m, left_m) <= SET_OUT * params.xy_goal_tolerance
            if not is_here and abs(turn_rad) > ASIDE_RAD:
                rate_radps = self._turning_speed(turn_rad, motion.angular_radps)
                if self._has_begun_here or not is_clear(0.0, rate_radps):
                    return None
                return self._reachable(0.0, motion.linear_mps, params.acc_lim_x), rate_radps
        if is_here or not is_clear(ahead_m / params.sim_time, turn_rad / params.sim_time):
            return None
        self._is_approaching = True
        # The arc that ends at the goal, within the limits.
        near_m = NEAR * params.xy_goal_tolerance
        curvature_1pm = 2.0 * left_m / (ahead_m**2 + left_m**2) if abs(left_m) > near_m else 0.0
        slowest_mps, speed_mps = (approach_speed(params, self._sim_period_s, way_m) for way_m in (near_m, ahead_m))
        speed_mps = max(slowest_mps, speed_mps)
        if abs(curvature_1pm) * speed_mps > params.max_vel_theta:
            speed_mps = max(slowest_mps, params.max_vel_theta / abs(curvature_1pm))
        linear_mps = self._reachable(speed_mps, motion.linear_mps, params.acc_lim_x)
        rate_radps = min(max(linear_mps * curvature_1pm, -params.max_vel_theta), params.max_vel_theta)
        return linear_mps, self._reachable(rate_radps, motion.angular_radps, params.acc_lim_theta)

    def _has_turned(self, turn_rad: float, angular_radps: float) -> bool:
        has_passed, tolerance_rad = turn_rad * self._turn_began_rad < 0.0, self.params.yaw_goal_tolerance
        if abs(turn_rad) > tolerance_rad:
            self._is_aligned = False
        elif self._is_rotating:
            rest_rad = stopping_rest(angular_radps, self.params.acc_lim_theta, self._sim_period_s)
            self._is_aligned |= has_passed or abs(turn_rad) <= max(rest_rad, NEAR * tolerance_rad)
        else:
            self._is_aligned |= abs(turn_rad) <= SET_OUT * tolerance_rad
        if has_passed or not self._is_rotating:
            self._turn_began_rad = turn_rad
        return self._is_aligned


def approach_speed(params: DwaParams, period_s: float, way_m: float) -> float:
    """Return the highest speed [m/s] within the limits that allows a stop within `way_m`."""
    lag_s, deceleration_mps2 = LAG_PERIODS * period_s, params.acc_lim_x  # v lag + v^2 / (2 a) = way
    speed_mps = deceleration_mps2 * (math.sqrt(lag_s**2 + 2.0 * way_m / deceleration_mps2) - lag_s)
    return min(max(speed_mps, params.min_vel_trans, params.min_vel_x), params.max_vel_x, params.max_vel_trans)


def stopping_rest(velocity: float, deceleration: float, period_s: float) -> float:
    """Return the remaining distance at which to stop: braking, and half of the motion in one more period."""
    return 0.5 * velocity**2 / deceleration + 0.5 * abs(velocity) * period_s


class StopSpread(NamedTuple):
    """Distance from the goal and difference of heading; also the resolution of odometry."""

    position_m: float
    yaw_rad: float


def stop_parts(params: DwaParams, period_s: float, command_latency_s: float, step: StopSpread) -> Dict[str, StopSpread]:
    """Return the stopping error of the control loop at a goal by cause.

    The latency is from a pose to the wheels; `step` is a pulse of both wheels in translation, of one wheel in rotation.
    """
    tolerance_m, tolerance_rad = params.xy_goal_tolerance, params.yaw_goal_tolerance
    if params.stop == 'latch':
        margin = params.latch_margin if params.latch_xy_goal_tolerance else 0.0
        return {'latch circle': StopSpread((1.0 - margin) * tolerance_m, tolerance_rad)}
    speed_mps, rate_radps = approach_speed(params, period_s, NEAR * tolerance_m), params.min_vel_theta
    coasting_m = stopping_rest(speed_mps, params.acc_lim_x, period_s)
    return {
        'coasting': StopSpread(coasting_m, stopping_rest(rate_radps, params.acc_lim_theta, period_s)),
        'latency': StopSpread(speed_mps * command_latency_s, rate_radps * command_latency_s),
        'one pulse': step,
        'near enough': StopSpread(NEAR * tolerance_m, SET_OUT * tolerance_rad),
    }


def stop_spread(params: DwaParams, parts: Mapping[str, StopSpread]) -> StopSpread:
    """Return the stopping error of a robot at its goal by `stop_parts`: longitudinal errors add up."""
    *ahead, near = parts.values()
    if not ahead:  # the latch
        return near
    along_m, turn_rad = sum(part.position_m for part in ahead), sum(part.yaw_rad for part in ahead)
    apart_m, turned_rad = math.hypot(along_m, near.position_m), max(near.yaw_rad, turn_rad)
    return StopSpread(min(params.xy_goal_tolerance, apart_m), min(params.yaw_goal_tolerance, turned_rad))


LOOKAHEAD_M = 0.5  # along the plan, about the robot's length
END_FRACTION = 0.5  # of its start angle, at which a turn ends (hysteresis)


class TurnToPath:
    """Turns the robot towards a plan that starts behind it, before the DWA controls it."""

    def __init__(self, params: DwaParams, sim_period_s: float) -> None:
        self._angle_rad, self._turner = params.turn_to_path_angle, LatchedStopRotate(params, sim_period_s)
        self.reset()

    def reset(self) -> None:
        """Reset for a new plan."""
        self._is_turning = False
        self._turner.reset()

    def command(self, motion: Motion, plan: np.ndarray, is_clear: ClearanceCheck) -> Optional[Tuple[float, float]]:
        """Return (linear [m/s], angular [rad/s]) of the turn to a plan (n, 3), n > 0; None if not needed or blocked."""
        if self._angle_rad == 0.0:
            return None
        bearing_rad = bearing_ahead(plan, motion.base_pose.x_m, motion.base_pose.y_m)
        limit_rad = self._angle_rad * (END_FRACTION if self._is_turning else 1.0)
        if abs(wrap_angle(bearing_rad - motion.base_pose.yaw_rad)) <= limit_rad:
            self.reset()
            return None
        self._is_turning = True
        return self._turner.command(motion, motion.base_pose._replace(yaw_rad=bearing_rad), is_clear)


@compiled
def bearing_ahead(plan: Array, x_m: float, y_m: float) -> float:
    """Return the direction [rad] to the lookahead point of the plan (n, 3), or to its end if closer."""
    ahead, travelled_m = np.argmin(np.hypot(plan[:, 0] - x_m, plan[:, 1] - y_m)), 0.0
    while ahead < len(plan) - 1 and travelled_m < LOOKAHEAD_M:
        travelled_m += math.hypot(plan[ahead + 1, 0] - plan[ahead, 0], plan[ahead + 1, 1] - plan[ahead, 1])
        ahead += 1
    return math.atan2(plan[ahead, 1] - y_m, plan[ahead, 0] - x_m)


# rotate_recovery's defaults.
SIM_GRANULARITY_RAD, MIN_IN_PLACE_RADPS, TOLERANCE_RAD = 0.017, 0.4, 0.1


class Rotation:
    """A turn once around in place to the left, as rotate_recovery, unless an obstacle is in the way."""

    def __init__(self, params: DwaParams, now_ns: int, base_pose_in_odom: Pose2D) -> None:
        self._params, self._yaw_rad, self._turned_rad = params, base_pose_in_odom.yaw_rad, 0.0
        # Twice the time of the slowest turn; upstream would wait forever for a robot that does not turn.
        self._until_ns = now_ns + int(2.0 * 2.0 * math.pi / min(MIN_IN_PLACE_RADPS, params.max_vel_theta) * 1e9)

    def step(self, now_ns: int, pose: Pose2D, costmap: Costmap) -> Tuple[Optional[float], str]:
        """Return the angular velocity [rad/s], None at the end of the turn, and a text; all in the odom frame."""
        self._turned_rad += wrap_angle(pose.yaw_rad - self._yaw_rad)
        self._yaw_rad = pose.yaw_rad
        left_rad = 2.0 * math.pi - self._turned_rad
        if left_rad < TOLERANCE_RAD:
            return None, 'turned once around'
        if now_ns > self._until_ns:
            return None, 'gave up turning: the robot does not turn'
        for step in range(math.ceil(left_rad / SIM_GRANULARITY_RAD)):
            if costmap.footprint_cost(pose._replace(yaw_rad=pose.yaw_rad + step * SIM_GRANULARITY_RAD)) < 0.0:
                return None, 'cannot turn: an obstacle is in the way'
        speed_radps = max(math.sqrt(2.0 * self._params.acc_lim_theta * left_rad), MIN_IN_PLACE_RADPS)
        return min(speed_radps, self._params.max_vel_theta), 'turning'
