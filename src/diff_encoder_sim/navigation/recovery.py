"""Recovery behaviours: forget obstacles, turn around, so that a path may open."""

from __future__ import annotations

import math
from typing import List, NamedTuple, Optional, Tuple

from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.navigator_params import CLEAR_COSTMAP, ROTATE, DwaParams, NavigatorParams, RecoveryType

# move_base's default: clear far away, turn, clear close by, turn.
USUAL = ('conservative_reset', 'rotate_recovery', 'aggressive_reset', 'rotate_recovery')

# clear_costmap_recovery's default, for behaviours of other names.
RESET_DISTANCE_M = 3.0


class Recovery(NamedTuple):
    """One behaviour: a turn, or forgetting obstacles outside a square around the robot (clear_costmap_recovery)."""

    name: str
    type: RecoveryType
    reset_distance_m: float  # side of the square


def recoveries_of(params: NavigatorParams, costmap: Costmap) -> List[Recovery]:
    """Return the behaviours that the parameters list, in the order in which they are tried."""
    if not params.recovery_behavior_enabled:
        return []
    usual = [(name, ROTATE if name == 'rotate_recovery' else CLEAR_COSTMAP) for name in USUAL]
    wanted = [(one.name, one.type) for one in params.recovery_behaviors] or [
        (name, kind) for name, kind in usual if params.clearing_rotation_allowed or kind != ROTATE
    ]
    reset_distances_m = {
        'conservative_reset': params.conservative_reset_dist,
        'aggressive_reset': 4.0 * costmap.footprint.circumscribed_radius_m,
    }
    return [Recovery(name, kind, reset_distances_m.get(name, RESET_DISTANCE_M)) for name, kind in wanted]


SIM_GRANULARITY_RAD, MIN_IN_PLACE_RADPS, TOLERANCE_RAD = 0.017, 0.4, 0.1  # rotate_recovery's defaults


class Rotation:
    """A turn once around in place to the left, as rotate_recovery, unless an obstacle is in the way."""

    def __init__(self, params: DwaParams, now_ns: int, base_pose_in_odom: Pose2D) -> None:
        self._params, self._yaw_rad, self._turned_rad = params, base_pose_in_odom.yaw_rad, 0.0
        # Upstream would wait forever for a robot that does not turn. Twice the time of the slowest turn.
        slowest_radps = min(MIN_IN_PLACE_RADPS, params.max_vel_theta)
        self._until_ns = now_ns + int(2.0 * 2.0 * math.pi / slowest_radps * 1e9)

    def step(self, now_ns: int, pose: Pose2D, costmap: Costmap) -> Tuple[Optional[float], str]:
        """Return the angular velocity [rad/s], as fast as the robot can still stop at the end, and a text.

        The velocity is None when the turn has ended. Pose and costmap are the local ones, in odom.
        """
        self._turned_rad += wrap_angle(pose.yaw_rad - self._yaw_rad)
        self._yaw_rad = pose.yaw_rad
        left_rad = 2.0 * math.pi - self._turned_rad
        if left_rad < TOLERANCE_RAD:
            return None, 'turned once around'
        if now_ns > self._until_ns:
            return None, 'gave up turning: the robot does not turn'
        headings = (
            pose.yaw_rad + step * SIM_GRANULARITY_RAD for step in range(math.ceil(left_rad / SIM_GRANULARITY_RAD))
        )
        if any(costmap.footprint_cost(pose._replace(yaw_rad=heading_rad)) < 0.0 for heading_rad in headings):
            return None, 'cannot turn: an obstacle is in the way'
        speed_radps = max(math.sqrt(2.0 * self._params.acc_lim_theta * left_rad), MIN_IN_PLACE_RADPS)
        return min(speed_radps, self._params.max_vel_theta), 'turning'
