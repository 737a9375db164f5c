"""Stop near the middle of the goal's tolerances: `stop: precise` (docs/adr/0009-last-centimetres.md)."""

from __future__ import annotations

import math
from typing import Optional, Tuple

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.navigation.dwa_params import DwaParams
from diff_encoder_sim.navigation.stop_rotate import ClearanceCheck, LatchedStopRotate, Motion

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
        if turn is None and abs(self._remaining_turn(motion, goal)) <= self.params.yaw_goal_tolerance:
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
