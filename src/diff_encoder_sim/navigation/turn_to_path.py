"""A turn on the spot when the plan leads off behind the robot.

The DWA alone can stay there for ever. Its distances are counted over four neighbours, and by that
measure the nose first gets farther from the goal however the robot turns: a local minimum that the
dynamic window is too small to see across (`test_navigation_dwa.py` shows it). Upstream has it too;
ROS 2's rotation shim controller is the same remedy. turn_to_path_angle: 0.0 switches it off.
"""

from __future__ import annotations

import math
from typing import Optional, Tuple

import numpy as np
from numba import njit

from diff_encoder_sim.base.se2 import wrap_angle
from diff_encoder_sim.navigation.dwa_params import DwaParams
from diff_encoder_sim.navigation.stop_rotate import ClearanceCheck, LatchedStopRotate, Motion

# How far ahead on the plan the robot looks for its direction: about its own length.
LOOKAHEAD_M = 0.5

# Once turning, the robot goes on until this share of the angle is left: no flicker.
SHARE_LEFT = 0.5


class TurnToPath:
    """Turns the robot towards a plan that starts behind it, then leaves it to the DWA."""

    def __init__(self, params: DwaParams, sim_period_s: float) -> None:
        self._angle_rad = params.turn_to_path_angle
        self._turner = LatchedStopRotate(params, sim_period_s)
        self.reset()

    def reset(self) -> None:
        """A new plan."""
        self._is_turning = False
        self._turner.reset()

    def command(self, motion: Motion, plan: np.ndarray, is_clear: ClearanceCheck) -> Optional[Tuple[float, float]]:
        """(linear [m/s], angular [rad/s]) of the turn; None when there is none to make.

        Args:
            motion: the robot.
            plan: (n, 3) in the same frame, n > 0.
            is_clear: a turn that would collide is not made.
        """
        if self._angle_rad == 0.0:
            return None
        bearing_rad = bearing_ahead(plan, motion.base_pose.x_m, motion.base_pose.y_m)
        limit_rad = self._angle_rad * (SHARE_LEFT if self._is_turning else 1.0)
        if abs(wrap_angle(bearing_rad - motion.base_pose.yaw_rad)) <= limit_rad:
            self.reset()
            return None
        self._is_turning = True
        goal = motion.base_pose._replace(yaw_rad=bearing_rad)
        return self._turner.command(motion, goal, is_clear)


@njit(cache=True)
def bearing_ahead(plan: np.ndarray, x_m: float, y_m: float) -> float:
    """Direction [rad] from a place to where the plan (n, 3) leads on, near its end to that."""
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
