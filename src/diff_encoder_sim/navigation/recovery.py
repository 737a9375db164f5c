"""Recovery behaviours: forget obstacles, turn around, in the hope that a way opens."""

from __future__ import annotations

import math
from typing import List, NamedTuple, Optional

from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.dwa_params import DwaParams
from diff_encoder_sim.navigation.navigator_params import CLEAR_COSTMAP, ROTATE, NavigatorParams

# What move_base does when it is not told: clear far away, turn, clear close by, turn.
USUAL = (
    ('conservative_reset', CLEAR_COSTMAP),
    ('rotate_recovery', ROTATE),
    ('aggressive_reset', CLEAR_COSTMAP),
    ('rotate_recovery', ROTATE),
)

# clear_costmap_recovery's own, for behaviours of other names.
RESET_DISTANCE_M = 3.0


class RecoveryView(NamedTuple):
    """What a behaviour sees of the robot and may change."""

    now_ns: int
    base_pose_in_map: Pose2D
    base_pose_in_odom: Pose2D
    global_costmap: Costmap
    local_costmap: Costmap


class RecoveryStep(NamedTuple):
    """What a behaviour wants for the next control period."""

    is_done: bool
    angular_radps: float = 0.0
    text: str = ''


class Recovery:
    """One behaviour: `start`, then `step` each control period until it is done."""

    name = ''

    def start(self) -> None:
        """Forget the last time."""

    def step(self, view: RecoveryView) -> RecoveryStep:
        """Act for one control period."""
        raise NotImplementedError


class ClearCostmap(Recovery):
    """Forgets the obstacle layers of both costmaps outside a square around the robot.

    clear_costmap_recovery; done in one step.
    """

    def __init__(self, name: str, reset_distance_m: float) -> None:
        self.name = name
        self._reset_distance_m = reset_distance_m

    def step(self, view: RecoveryView) -> RecoveryStep:
        view.global_costmap.clear_obstacles(view.base_pose_in_map, self._reset_distance_m)
        view.local_costmap.clear_obstacles(view.base_pose_in_odom, self._reset_distance_m)
        side = f'{self._reset_distance_m:.2f} m'
        return RecoveryStep(True, text=f'obstacles outside a square of {side} forgotten')


class Rotate(Recovery):
    """One full turn on the spot to the left, as rotate_recovery, unless something is in the way."""

    sim_granularity_rad = 0.017
    min_in_place_vel_theta = 0.4
    tolerance_rad = 0.1

    def __init__(self, name: str, params: DwaParams) -> None:
        self.name = name
        self._params = params
        self.start()

    def start(self) -> None:
        self._turned_rad = 0.0
        self._last_yaw_rad: Optional[float] = None
        self._started_ns = 0

    def step(self, view: RecoveryView) -> RecoveryStep:
        pose = view.base_pose_in_odom
        if self._last_yaw_rad is None:
            self._started_ns = view.now_ns
        else:
            self._turned_rad += wrap_angle(pose.yaw_rad - self._last_yaw_rad)
        self._last_yaw_rad = pose.yaw_rad
        left_rad = 2.0 * math.pi - self._turned_rad
        if left_rad < self.tolerance_rad:
            return RecoveryStep(True, text='turned once around')
        # Upstream would wait for ever for a robot that does not turn.
        if view.now_ns - self._started_ns > self._patience_ns():
            return RecoveryStep(True, text='gave up turning: the robot does not follow')
        if not self._can_turn(view.local_costmap, pose, left_rad):
            return RecoveryStep(True, text='cannot turn: an obstacle is in the way')
        speed = math.sqrt(2.0 * self._params.acc_lim_theta * left_rad)
        speed = min(max(speed, self.min_in_place_vel_theta), self._params.max_vel_theta)
        return RecoveryStep(False, speed, 'turning')

    def _patience_ns(self) -> int:
        slowest = min(self.min_in_place_vel_theta, self._params.max_vel_theta)
        return int(2.0 * 2.0 * math.pi / slowest * 1e9)

    def _can_turn(self, costmap: Costmap, pose: Pose2D, left_rad: float) -> bool:
        steps = math.ceil(left_rad / self.sim_granularity_rad)
        return all(
            costmap.footprint_cost(pose._replace(yaw_rad=pose.yaw_rad + step * self.sim_granularity_rad)) >= 0.0
            for step in range(steps)
        )


def recoveries(params: NavigatorParams, costmap: Costmap) -> List[Recovery]:
    """The behaviours that the parameters ask for, in the order they are tried."""
    if not params.recovery_behavior_enabled:
        return []
    wanted = [(one.name, one.type) for one in params.recovery_behaviors] or [
        (name, kind) for name, kind in USUAL if params.clearing_rotation_allowed or kind != ROTATE
    ]
    reset_distances_m = {
        'conservative_reset': params.conservative_reset_dist,
        'aggressive_reset': 4.0 * costmap.footprint.circumscribed_radius_m,
    }
    return [
        Rotate(name, params.DWAPlannerROS)
        if kind == ROTATE
        else ClearCostmap(name, reset_distances_m.get(name, RESET_DISTANCE_M))
        for name, kind in wanted
    ]
