"""Stopping at the goal and turning in place."""

from __future__ import annotations

import math
from typing import Callable, Dict, NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.base.kernels import Array, compiled
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
        return self._is_latched if params.latch_xy_goal_tolerance else distance_m <= params.xy_goal_tolerance

    def is_goal_reached(self, motion: Motion, goal: Pose2D) -> bool:
        """Return whether the robot stands at the goal, position and heading within tolerance."""
        if not self.is_position_reached(motion, goal):
            return False
        return abs(_turn_left(motion, goal)) <= self.params.yaw_goal_tolerance and self._is_stopped(motion)

    def command(self, motion: Motion, goal: Pose2D, is_clear: ClearanceCheck) -> Optional[Tuple[float, float]]:
        """Return (linear [m/s], angular [rad/s]) to stop and then turn; None if that would collide."""
        turn_rad = _turn_left(motion, goal)
        if self._has_turned(turn_rad, motion.angular_radps):
            self._is_rotating = False
            return 0.0, 0.0
        if self._is_rotating or self._is_stopped(motion):
            self._is_rotating = True
            command = 0.0, self._turning_speed(turn_rad, motion.angular_radps)
        else:  # one period of braking at the acceleration limits
            limits = (motion.linear_mps, self.params.acc_lim_x), (motion.angular_radps, self.params.acc_lim_theta)
            linear_mps, angular_radps = (
                math.copysign(max(0.0, abs(velocity) - limit * self._sim_period_s), velocity)
                for velocity, limit in limits
            )
            command = linear_mps, angular_radps
        return command if is_clear(*command) else None

    def _has_turned(self, turn_rad: float, _: float) -> bool:
        return abs(turn_rad) <= self.params.yaw_goal_tolerance

    def _is_stopped(self, motion: Motion) -> bool:
        params = self.params
        return (
            abs(motion.linear_mps) <= params.trans_stopped_vel and abs(motion.angular_radps) <= params.theta_stopped_vel
        )

    def _turning_speed(self, turn_rad: float, angular_radps: float) -> float:
        """Return the speed [rad/s] that ends the turn in a second, as far as it can be reached and stopped in time."""
        params = self.params
        change, lowest, highest = params.acc_lim_theta * self._sim_period_s, params.min_vel_theta, params.max_vel_theta
        speed = min(highest, max(lowest, abs(turn_rad)))
        speed = min(max(speed, abs(angular_radps) - change), abs(angular_radps) + change)
        speed = min(speed, math.sqrt(2.0 * params.acc_lim_theta * abs(turn_rad)))
        return math.copysign(min(highest, max(lowest, speed)), turn_rad)


def _turn_left(motion: Motion, goal: Pose2D) -> float:
    """Return the turn that is left to the goal's heading [rad]."""
    return wrap_angle(goal.yaw_rad - motion.base_pose.yaw_rad)


# The robot does not set out for less than this fraction of a tolerance. At 40 PPR a pulse of one wheel turns it by 2.25
# degrees: who turned by one for less than half of that would be farther off than before.
SET_OUT = 1.0 / 3.0

# A robot that has driven into the tolerance turns in place towards a goal that is farther to the side than this: the
# robot came past it.
ASIDE_RAD = math.radians(45.0)

# What is near, as a fraction of a tolerance: a goal that is less to the side is not steered to, and over such a rest of
# its way the robot becomes no slower.
NEAR = 0.1

# Control periods from a pose to the end of the command that follows from it: one of its own, and one for the way of the
# pose to the navigator and of the command to the wheels.
LAG_PERIODS = 2.0


class PreciseStop(LatchedStopRotate):
    """Drives on from the edge of the tolerance to the place nearest to the goal, then turns to its heading.

    It never drives backwards, and where it has begun within the tolerance it does not turn to come nearer: what the
    goal is off to the side stays, as far as steering on the way does not mend it. Place and heading are latched when
    they are reached or passed for the first time: where odometry jumps by a pulse across the goal, no search begins.
    """

    def reset(self) -> None:
        """Begin a new plan: nothing is reached."""
        super().reset()
        self._is_within_tolerance = self._is_approaching = self._has_arrived = self._is_aligned = False
        self._has_begun_here: Optional[bool] = None  # within the tolerance; None until that is known
        self._turn_began_rad = 0.0  # what was left to turn where the turn began

    def is_position_reached(self, motion: Motion, goal: Pose2D) -> bool:
        """Return whether the robot is within tolerance, or has arrived there and that is latched."""
        params = self.params
        if self._has_arrived and params.latch_xy_goal_tolerance:
            return True
        margin = 0.0 if self._is_within_tolerance else params.latch_margin
        distance_m = math.hypot(goal.x_m - motion.base_pose.x_m, goal.y_m - motion.base_pose.y_m)
        self._is_within_tolerance = distance_m <= (1.0 - margin) * params.xy_goal_tolerance
        if self._has_begun_here is None:
            self._has_begun_here = self._is_within_tolerance
        self._is_approaching &= self._is_within_tolerance
        self._has_arrived &= self._is_within_tolerance
        return self._is_within_tolerance

    def is_goal_reached(self, motion: Motion, goal: Pose2D) -> bool:
        """Return whether the robot stands where it comes no nearer, with the goal's heading."""
        return super().is_goal_reached(motion, goal) and self._has_arrived and self._is_aligned

    def command(self, motion: Motion, goal: Pose2D, is_clear: ClearanceCheck) -> Optional[Tuple[float, float]]:
        """Return (linear [m/s], angular [rad/s]) to drive up, stop and turn; None if a turn that is due collides."""
        if not self._has_arrived:
            approach = self._approach(motion, goal.relative_to(motion.base_pose), is_clear)
            if approach is not None:
                return approach
            self._has_arrived = True
        turn = super().command(motion, goal, is_clear)
        if turn is None and abs(_turn_left(motion, goal)) <= self.params.yaw_goal_tolerance:
            self._is_aligned = True
            return 0.0, 0.0
        return turn

    def _approach(
        self, motion: Motion, goal_in_base: Pose2D, is_clear: ClearanceCheck
    ) -> Optional[Tuple[float, float]]:
        """Return the command towards the place nearest to the goal; None if that is here, or the way is not clear."""
        params, (ahead_m, left_m, _) = self.params, goal_in_base
        turn_rad = math.atan2(left_m, ahead_m)
        if self._is_approaching:
            is_here = ahead_m <= stopping_rest(motion.linear_mps, params.acc_lim_x, self._sim_period_s)
        else:
            is_here = math.hypot(ahead_m, left_m) <= SET_OUT * params.xy_goal_tolerance
            if not is_here and abs(turn_rad) > ASIDE_RAD:
                return None if self._has_begun_here else self._face(turn_rad, motion, is_clear)
        if is_here or not is_clear(ahead_m / params.sim_time, turn_rad / params.sim_time):
            return None
        self._is_approaching = True
        return self._arc(ahead_m, left_m, motion)

    def _face(self, turn_rad: float, motion: Motion, is_clear: ClearanceCheck) -> Optional[Tuple[float, float]]:
        """Return the command that turns the robot in place towards the goal; None if that would collide."""
        linear_mps = self._reachable(0.0, motion.linear_mps, self.params.acc_lim_x)
        rate_radps = self._turning_speed(turn_rad, motion.angular_radps)
        return (linear_mps, rate_radps) if is_clear(0.0, rate_radps) else None

    def _arc(self, ahead_m: float, left_m: float, motion: Motion) -> Tuple[float, float]:
        """Return the velocities, within the limits, on the arc that ends at the goal, as slow as that needs."""
        params, near_m = self.params, NEAR * self.params.xy_goal_tolerance
        curvature_1pm = 2.0 * left_m / (ahead_m**2 + left_m**2) if abs(left_m) > near_m else 0.0
        slowest_mps = approach_speed(params, self._sim_period_s, near_m)
        speed_mps = max(slowest_mps, approach_speed(params, self._sim_period_s, ahead_m))
        if abs(curvature_1pm) * speed_mps > params.max_vel_theta:
            speed_mps = max(slowest_mps, params.max_vel_theta / abs(curvature_1pm))
        linear_mps = self._reachable(speed_mps, motion.linear_mps, params.acc_lim_x)
        rate_radps = min(max(linear_mps * curvature_1pm, -params.max_vel_theta), params.max_vel_theta)
        return linear_mps, self._reachable(rate_radps, motion.angular_radps, params.acc_lim_theta)

    def _reachable(self, velocity: float, now: float, acceleration: float) -> float:
        """Return the velocity, or what of it one period reaches."""
        change = acceleration * self._sim_period_s
        return min(max(velocity, now - change), now + change)

    def _has_turned(self, turn_rad: float, angular_radps: float) -> bool:
        params, has_passed = self.params, turn_rad * self._turn_began_rad < 0.0
        tolerance_rad = params.yaw_goal_tolerance
        if abs(turn_rad) > tolerance_rad:
            self._is_aligned = False
        elif self._is_rotating:
            rest_rad = stopping_rest(angular_radps, params.acc_lim_theta, self._sim_period_s)
            self._is_aligned |= has_passed or abs(turn_rad) <= max(rest_rad, NEAR * tolerance_rad)
        else:
            self._is_aligned |= abs(turn_rad) <= SET_OUT * tolerance_rad
        if has_passed or not self._is_rotating:
            self._turn_began_rad = turn_rad
        return self._is_aligned


def approach_speed(params: DwaParams, period_s: float, way_m: float) -> float:
    """Return the highest speed [m/s], within the limits, from which a robot still stops within `way_m`."""
    lag_s, deceleration_mps2 = LAG_PERIODS * period_s, params.acc_lim_x
    # v lag + v^2 / (2 a) = way
    speed_mps = deceleration_mps2 * (math.sqrt(lag_s**2 + 2.0 * way_m / deceleration_mps2) - lag_s)
    return min(max(speed_mps, params.min_vel_trans, params.min_vel_x), params.max_vel_x, params.max_vel_trans)


def stopping_rest(velocity: float, deceleration: float, period_s: float) -> float:
    """Return the way left at which to stop: braking, and half of what one more period would move."""
    return 0.5 * velocity**2 / deceleration + 0.5 * abs(velocity) * period_s


class StopSpread(NamedTuple):
    """Distance from the goal and difference of heading."""

    position_m: float
    yaw_rad: float


class PoseStep(NamedTuple):
    """What a pose of odometry moves by at least: a pulse of both wheels ahead, of one around."""

    position_m: float
    yaw_rad: float


# Causes of a spread.
LATCH, COASTING, LATENCY, PULSE, NEAR_ENOUGH = 'latch circle', 'coasting', 'latency', 'one pulse', 'near enough'


def stop_parts(params: DwaParams, period_s: float, command_latency_s: float, step: PoseStep) -> Dict[str, StopSpread]:
    """Return what a robot that has driven up to its goal may be off by for each cause, as the control loop leaves it.

    Args:
        params: tolerances and limits.
        period_s: the control period [s].
        command_latency_s: from a pose to the wheels [s].
        step: of the odometry.
    """
    tolerance_m, tolerance_rad = params.xy_goal_tolerance, params.yaw_goal_tolerance
    if params.stop == 'latch':
        margin = params.latch_margin if params.latch_xy_goal_tolerance else 0.0
        return {LATCH: StopSpread((1.0 - margin) * tolerance_m, tolerance_rad)}
    speed_mps, rate_radps = approach_speed(params, period_s, NEAR * tolerance_m), params.min_vel_theta
    coasting_m = stopping_rest(speed_mps, params.acc_lim_x, period_s)
    return {
        COASTING: StopSpread(coasting_m, stopping_rest(rate_radps, params.acc_lim_theta, period_s)),
        LATENCY: StopSpread(speed_mps * command_latency_s, rate_radps * command_latency_s),
        PULSE: StopSpread(*step),
        NEAR_ENOUGH: StopSpread(NEAR * tolerance_m, SET_OUT * tolerance_rad),
    }


def stop_spread(params: DwaParams, period_s: float, command_latency_s: float, step: PoseStep) -> StopSpread:
    """Return the spread of a robot that has driven up to its goal; arguments as of `stop_parts`.

    Ahead, what coasts, is late and is counted adds up, across the robot is as near as it has to be; of the heading, the
    larger one of both.
    """
    *ahead, near = stop_parts(params, period_s, command_latency_s, step).values()
    if not ahead:  # the latch
        return near
    along_m, turn_rad = sum(part.position_m for part in ahead), sum(part.yaw_rad for part in ahead)
    return StopSpread(
        min(params.xy_goal_tolerance, math.hypot(along_m, near.position_m)),
        min(params.yaw_goal_tolerance, max(near.yaw_rad, turn_rad)),
    )


# Distance along the plan to the point that gives the direction: about the robot's length.
LOOKAHEAD_M = 0.5

# A turn ends at this fraction of the angle that begins one, so that turns do not flicker.
END_FRACTION = 0.5


class TurnToPath:
    """Turns the robot towards a plan that begins behind it, then leaves it to the DWA."""

    def __init__(self, params: DwaParams, sim_period_s: float) -> None:
        self._angle_rad = params.turn_to_path_angle
        self._turner = LatchedStopRotate(params, sim_period_s)
        self.reset()

    def reset(self) -> None:
        """Begin a new plan."""
        self._is_turning = False
        self._turner.reset()

    def command(self, motion: Motion, plan: np.ndarray, is_clear: ClearanceCheck) -> Optional[Tuple[float, float]]:
        """Return (linear [m/s], angular [rad/s]) of the turn; None if there is no need, or it would collide.

        The plan (n, 3), n > 0, is in the frame of the motion.
        """
        if self._angle_rad == 0.0:
            return None
        bearing_rad = bearing_ahead(plan, motion.base_pose.x_m, motion.base_pose.y_m)
        limit_rad = self._angle_rad * (END_FRACTION if self._is_turning else 1.0)
        if abs(wrap_angle(bearing_rad - motion.base_pose.yaw_rad)) <= limit_rad:
            self.reset()
            return None
        self._is_turning = True
        goal = motion.base_pose._replace(yaw_rad=bearing_rad)
        return self._turner.command(motion, goal, is_clear)


@compiled
def bearing_ahead(plan: Array, x_m: float, y_m: float) -> float:
    """Return the direction [rad] from a place to the point of the plan (n, 3) ahead, or to its end if that is near."""
    nearest, least_m = 0, math.inf
    for index in range(len(plan)):
        distance_m = math.hypot(plan[index, 0] - x_m, plan[index, 1] - y_m)
        if distance_m < least_m:
            nearest, least_m = index, distance_m
    ahead, travelled_m = nearest, 0.0
    while ahead < len(plan) - 1 and travelled_m < LOOKAHEAD_M:
        travelled_m += math.hypot(plan[ahead + 1, 0] - plan[ahead, 0], plan[ahead + 1, 1] - plan[ahead, 1])
        ahead += 1
    return math.atan2(plan[ahead, 1] - y_m, plan[ahead, 0] - x_m)
