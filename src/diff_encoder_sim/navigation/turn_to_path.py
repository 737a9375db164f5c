"""Turn in place when the plan begins behind the robot.

The DWA alone can stay there forever. Its distances are counted over four neighbours, and by that measure the nose
first gets farther from the goal whichever way the robot turns: a local minimum that is wider than the dynamic window
(shown in test_turn_to_path.py). Upstream has it too; ROS 2's rotation shim controller is the same remedy.
turn_to_path_angle: 0.0 switches it off.
"""

from __future__ import annotations

import math
from typing import Optional, Tuple

import numpy as np

from diff_encoder_sim.base.compiled import compiled
from diff_encoder_sim.base.se2 import wrap_angle
from diff_encoder_sim.navigation.dwa_params import DwaParams
from diff_encoder_sim.navigation.stop_rotate import ClearanceCheck, LatchedStopRotate, Motion

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
def bearing_ahead(plan: np.ndarray, x_m: float, y_m: float) -> float:
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
