"""Recovery behaviours: forget obstacles, turn around, so that a path may open."""

from __future__ import annotations

import math
from typing import List, NamedTuple, Optional, Tuple

from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.dwa_params import DwaParams
from diff_encoder_sim.navigation.navigator_inputs import Command, StartedRecovery, Trigger
from diff_encoder_sim.navigation.navigator_params import CLEAR_COSTMAP, ROTATE, NavigatorParams, RecoveryType

# move_base's default: clear far away, turn, clear close by, turn.
USUAL: List[Tuple[str, RecoveryType]] = [
    ('conservative_reset', CLEAR_COSTMAP),
    ('rotate_recovery', ROTATE),
    ('aggressive_reset', CLEAR_COSTMAP),
    ('rotate_recovery', ROTATE),
]

# clear_costmap_recovery's default, for behaviours of other names.
RESET_DISTANCE_M = 3.0


class RecoveryView(NamedTuple):
    """State of the robot and the costmaps that a behaviour may change."""

    now_ns: int
    base_pose_in_map: Pose2D
    base_pose_in_odom: Pose2D
    global_costmap: Costmap
    local_costmap: Costmap


class RecoveryStep(NamedTuple):
    """Result of one control period of a behaviour."""

    is_done: bool
    angular_radps: float = 0.0
    text: str = ''


class Recovery:
    """One behaviour: call `start`, then `step` in each control period until it is done."""

    name = ''

    def start(self) -> None:
        """Begin anew."""

    def step(self, view: RecoveryView) -> RecoveryStep:
        """Act for one control period."""
        raise NotImplementedError


class ClearCostmap(Recovery):
    """Forgets the obstacle layers of both costmaps outside a square around the robot, as clear_costmap_recovery."""

    def __init__(self, name: str, reset_distance_m: float) -> None:
        self.name = name
        self._reset_distance_m = reset_distance_m

    def step(self, view: RecoveryView) -> RecoveryStep:
        """Clear both costmaps; done in one step."""
        view.global_costmap.clear_obstacles(view.base_pose_in_map, self._reset_distance_m)
        view.local_costmap.clear_obstacles(view.base_pose_in_odom, self._reset_distance_m)
        return RecoveryStep(True, text=f'obstacles outside a square of {self._reset_distance_m:.2f} m forgotten')


class Rotate(Recovery):
    """Turns once around in place to the left, as rotate_recovery, unless an obstacle is in the way."""

    sim_granularity_rad = 0.017
    min_in_place_vel_theta = 0.4
    tolerance_rad = 0.1

    def __init__(self, name: str, params: DwaParams) -> None:
        self.name = name
        self._params = params
        self.start()

    def start(self) -> None:
        """Begin a turn."""
        self._turned_rad = 0.0
        self._last_yaw_rad: Optional[float] = None
        self._started_ns = 0

    def step(self, view: RecoveryView) -> RecoveryStep:
        """Turn on, as fast as the robot can still stop at the end."""
        self._count_turn(view)
        left_rad = 2.0 * math.pi - self._turned_rad
        if left_rad < self.tolerance_rad:
            return RecoveryStep(True, text='turned once around')
        # Upstream would wait forever for a robot that does not turn.
        if view.now_ns - self._started_ns > self._patience_ns():
            return RecoveryStep(True, text='gave up turning: the robot does not turn')
        if not self._can_turn(view.local_costmap, view.base_pose_in_odom, left_rad):
            return RecoveryStep(True, text='cannot turn: an obstacle is in the way')
        speed = math.sqrt(2.0 * self._params.acc_lim_theta * left_rad)
        speed = min(max(speed, self.min_in_place_vel_theta), self._params.max_vel_theta)
        return RecoveryStep(False, speed, 'turning')

    def _count_turn(self, view: RecoveryView) -> None:
        """Add up the turn since the last step, or note the start."""
        yaw_rad = view.base_pose_in_odom.yaw_rad
        if self._last_yaw_rad is None:
            self._started_ns = view.now_ns
        else:
            self._turned_rad += wrap_angle(yaw_rad - self._last_yaw_rad)
        self._last_yaw_rad = yaw_rad

    def _patience_ns(self) -> int:
        """Return twice the time of the slowest turn."""
        slowest = min(self.min_in_place_vel_theta, self._params.max_vel_theta)
        return int(2.0 * 2.0 * math.pi / slowest * 1e9)

    def _can_turn(self, costmap: Costmap, pose: Pose2D, left_rad: float) -> bool:
        """Return whether the rest of the turn is free of obstacles."""
        steps = math.ceil(left_rad / self.sim_granularity_rad)
        return all(
            costmap.footprint_cost(pose._replace(yaw_rad=pose.yaw_rad + step * self.sim_granularity_rad)) >= 0.0
            for step in range(steps)
        )


def make_recoveries(params: NavigatorParams, costmap: Costmap) -> List[Recovery]:
    """Make the behaviours that the parameters list, in the order in which they are tried."""
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


class RecoverySequence:
    """Runs recovery behaviours in their order, each until it is done.

    Args:
        recoveries: the behaviours; they outlive the sequence.
    """

    def __init__(self, recoveries: List[Recovery]) -> None:
        self._recoveries = recoveries
        self._index = 0  # of the behaviour that is next
        self._is_running = False
        self._trigger, self._problem = Trigger.PLANNING, ''
        self.started: Optional[StartedRecovery] = None  # the behaviour that the last `step` has begun

    def call(self, trigger: Trigger, problem: str) -> None:
        """Have the next behaviour started for a reason and its description."""
        self._trigger, self._problem, self._is_running = trigger, problem, False

    def restart_after(self, trigger: Trigger) -> None:
        """Go back to the first behaviour if the last call had this reason, which is over."""
        if self._trigger is trigger:
            self._index = 0

    @property
    def is_exhausted(self) -> bool:
        """Return whether all behaviours have been tried."""
        return self._index >= len(self._recoveries)

    @property
    def failure(self) -> str:
        """Return the reason of the last call, for messages."""
        tried = f' after {len(self._recoveries)} recovery behaviours' if self._recoveries else ''
        return f'{self._trigger.value}{tried}: {self._problem}'

    def step(self, view: RecoveryView) -> RecoveryStep:
        """Run the next behaviour for one control period; only while not exhausted."""
        recovery = self._recoveries[self._index]
        self.started = None
        if not self._is_running:
            recovery.start()
            self._is_running = True
            self.started = StartedRecovery(recovery.name, self._index, len(self._recoveries))
        result = recovery.step(view)
        if result.is_done:
            self._index += 1
        return result._replace(text=f'{recovery.name}: {result.text}')


class TravelWatch:
    """Sums the commanded travel since the odometry's pose last changed.

    Args:
        limit_m: travel above which the robot may be driving blind; 0: no limit.
        turning_radius_m: a turn in place counts as the travel of a point at this radius.
    """

    def __init__(self, limit_m: float, turning_radius_m: float) -> None:
        self.limit_m = limit_m
        self._turning_radius_m = turning_radius_m
        self.reset()

    def reset(self) -> None:
        """Set the sum to zero and forget the last pose."""
        self.unseen_m = 0.0
        self._pose: Optional[Pose2D] = None
        self._updated_ns = 0

    def update(self, now_ns: int, base_pose_in_odom: Pose2D, command: Command) -> None:
        """Enter one control period: the newest pose, and the command since the last call."""
        if base_pose_in_odom != self._pose:
            self.unseen_m, self._pose = 0.0, base_pose_in_odom
        else:
            speed_mps = abs(command.linear_mps) + abs(command.angular_radps) * self._turning_radius_m
            self.unseen_m += speed_mps * max(0, now_ns - self._updated_ns) / NANOSECONDS_PER_SECOND
        self._updated_ns = now_ns

    @property
    def is_over_limit(self) -> bool:
        """Return whether the travel is above the limit; never True for a limit of 0."""
        return 0.0 < self.limit_m < self.unseen_m
