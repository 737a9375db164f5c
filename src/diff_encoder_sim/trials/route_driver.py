"""Drives a robot along a test's route: sends goals to the navigator, and commands turns in place."""

from __future__ import annotations

import logging
import math
from collections import deque
from typing import List, NamedTuple, Optional, Union

import numpy as np

from diff_encoder_sim.base.errors import EVENT
from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.test_definition import SpeedLimits, TestDefinition
from diff_encoder_sim.drives.trial_definition import Outcome, RouteFailed
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.costmap_params import IN_OBSTACLE
from diff_encoder_sim.navigation.global_planner import GlobalPlanner, PlanError
from diff_encoder_sim.navigation.navigator_inputs import GoalStatus
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from diff_encoder_sim.simulation.simulator import DriveParams
from diff_encoder_sim.trials.scripted_drive import SETTLING_S

# The robot slows down with at most this fraction of the deceleration limit, finally in proportion to the remaining
# angle: commands are delayed, and it must not overshoot.
BRAKING_FRACTION = 0.3
APPROACH_PER_S = 1.5
STOP_WITHIN_RAD = 0.02
MOST_CROSSINGS = 2  # below 40 PPR the heading estimate jumps across the end; it does not get closer after these
POSE_TIMEOUT_S = 0.5  # age of the pose estimate that pauses a turn; the navigator's default input_timeout

log = logging.getLogger(__name__)


class DriverOutput(NamedTuple):
    """A goal to send, or a command; neither if the robot is to continue."""

    goal_in_map: Optional[Pose2D] = None  # for the navigator, replaces the current goal
    turn_rate_radps: Optional[float] = None  # for /cmd_vel; None: leave /cmd_vel to the navigator


class Destination(NamedTuple):
    """A stage of a route: a pose to send to the navigator."""

    pose_in_map: Pose2D
    is_stop: bool  # False: a waypoint, replaced by the next goal when it is near


class TurnInPlace:
    """A stage of a route: speeds up, turns, and slows down to a total angle of any number of turns."""

    def __init__(self, angle_rad: float, limits: SpeedLimits) -> None:
        self.angle_rad, self._limits, self.is_over = angle_rad, limits, False
        self._turned_rad, self._crossings, self._rate_radps = 0.0, 0, 0.0
        self._last_yaw_rad: Optional[float] = None
        self._last_ns: Optional[int] = None

    def rate(self, now_ns: int, yaw_rad: float) -> float:
        """Return the angular velocity to command [rad/s] at the heading estimated now.

        While it is not finite, the robot slows down and stops; up to half a turn in this time is counted afterwards.
        """
        interval_s = max(0, now_ns - (now_ns if self._last_ns is None else self._last_ns)) / NANOSECONDS_PER_SECOND
        self._last_ns, target_radps = now_ns, 0.0
        if math.isfinite(yaw_rad):
            left_before_rad = self.angle_rad - self._turned_rad
            if self._last_yaw_rad is not None:
                self._turned_rad += wrap_angle(yaw_rad - self._last_yaw_rad)
            self._last_yaw_rad = yaw_rad
            left_rad = self.angle_rad - self._turned_rad
            self._crossings += left_rad * left_before_rad < 0.0
            self.is_over = abs(left_rad) < STOP_WITHIN_RAD or self._crossings >= MOST_CROSSINGS
            braking_radps = math.sqrt(2.0 * BRAKING_FRACTION * self._limits.angular_acceleration * abs(left_rad))
            most_radps = min(self._limits.angular_speed, braking_radps, APPROACH_PER_S * abs(left_rad))
            target_radps = math.copysign(most_radps, left_rad)
        if self.is_over:
            return 0.0
        change_radps = self._limits.angular_acceleration * interval_s
        self._rate_radps += max(-change_radps, min(change_radps, target_radps - self._rate_radps))
        return self._rate_radps

    def halt(self) -> None:
        """Restart from rest at the next heading, after a stop of the robot."""
        self._rate_radps, self._last_ns = 0.0, None


def stages_of(test: TestDefinition) -> List[Union[Destination, TurnInPlace]]:
    """Return the stages of a test's route in order."""
    stages: List[Union[Destination, TurnInPlace]] = []
    for leg in test.route:
        if leg.turns is not None:
            stages.append(TurnInPlace(2.0 * math.pi * leg.turns, test.limits))
        elif leg.goal is not None:
            stages.append(Destination(leg.goal.pose(), True))
        else:
            # Each waypoint heads towards the next, in case the navigator stops there; the last has heading 0.
            points = leg.through or []
            for here, ahead in zip(points, [*points[1:], *points[-1:]]):
                pose = Pose2D(here.x, here.y, math.atan2(ahead.y - here.y, ahead.x - here.x))
                stages.append(Destination(pose, False))
    return stages


class RouteDriver:
    """Drives the stages of a route in order, using only the pose estimate.

    Call `step` with each pose estimate until it `is_over`, and `watch` at a steady rate, with or without estimates.
    """

    def __init__(self, test: TestDefinition) -> None:
        self._test, self._stages = test, deque(stages_of(test))  # not started
        self._stage: Union[Destination, TurnInPlace, None] = None
        self._started_ns: Optional[int] = None
        self._ended_ns: Optional[int] = None
        self._estimate_ns, self._is_halted, self.is_over = 0, False, False

    def watch(self, now_ns: int) -> DriverOutput:
        """Return a stop if the robot turns on an estimate older than POSE_TIMEOUT_S; RouteFailed after time_limit."""
        if self._started_ns is None:
            self._started_ns = now_ns
        if now_ns - self._started_ns > self._test.time_limit * NANOSECONDS_PER_SECOND:
            raise RouteFailed(Outcome.TIMED_OUT, f'not at its end after {self._test.time_limit:.0f} s (time_limit)')
        age_s = (now_ns - self._estimate_ns) / NANOSECONDS_PER_SECOND
        if not isinstance(self._stage, TurnInPlace) or age_s <= POSE_TIMEOUT_S:
            return DriverOutput()
        if not self._is_halted:
            log.warning('turn in place paused: the newest pose estimate is %.1f s old', age_s, extra=EVENT)
        self._is_halted = True
        self._stage.halt()
        return DriverOutput(turn_rate_radps=0.0)

    def step(self, now_ns: int, base_pose_in_map: Pose2D, status: GoalStatus, status_text: str) -> DriverOutput:
        """Return the goal or command for a pose estimate; RouteFailed if `status`, of the last goal, is aborted."""
        self._estimate_ns = now_ns
        if self._is_halted:
            log.info('turn in place continues: pose estimates are received again', extra=EVENT)
            self._is_halted = False
        if self._ended_ns is not None:
            self.is_over = now_ns - self._ended_ns >= SETTLING_S * NANOSECONDS_PER_SECOND
            return DriverOutput()
        if isinstance(self._stage, Destination):
            goal = self._stage.pose_in_map
            offset_m = math.hypot(base_pose_in_map.x_m - goal.x_m, base_pose_in_map.y_m - goal.y_m)
            is_passed = not self._stage.is_stop and offset_m <= self._test.pass_radius
            if not is_passed and status.is_over and status is not GoalStatus.SUCCEEDED:
                name = 'the goal' if self._stage.is_stop else f'the waypoint ({goal.x_m:.2f}, {goal.y_m:.2f})'
                raise RouteFailed(Outcome.ABORTED, f'{name} was not reached: {status_text or status.value}')
            if not is_passed and status is not GoalStatus.SUCCEEDED:
                return DriverOutput()
        rate_radps = None
        while True:
            if isinstance(self._stage, TurnInPlace):
                rate_radps = self._stage.rate(now_ns, base_pose_in_map.yaw_rad)
                if not self._stage.is_over:
                    return DriverOutput(turn_rate_radps=rate_radps)
            if not self._stages:
                self._stage, self._ended_ns = None, now_ns
                return DriverOutput(turn_rate_radps=rate_radps)
            self._stage = self._stages.popleft()
            if isinstance(self._stage, Destination):
                return DriverOutput(self._stage.pose_in_map, rate_radps)


STEP_M, STEP_RAD = 0.1, math.radians(10.0)  # spacing of the footprint checks along a leg


def misfit(test: TestDefinition, navigator: NavigatorParams, drive: DriveParams, grid: OccupancyGrid) -> Optional[str]:
    """Return why a robot with this outline, speeds and motors cannot navigate a test's route; None if it can."""
    costmap = Costmap(navigator.global_costmap, grid)
    planner, subject = GlobalPlanner(navigator.NavfnROS, costmap), f'test {test.name}: not for this robot'
    pose, length_m, turned_rad = test.start.pose(), 0.0, 0.0
    for stage in stages_of(test):
        if isinstance(stage, TurnInPlace):
            # At least one full turn covers all headings.
            angle_rad = math.copysign(min(abs(stage.angle_rad), 2.0 * math.pi), stage.angle_rad)
            angles = np.linspace(0.0, angle_rad, 1 + math.ceil(abs(angle_rad) / STEP_RAD)).tolist()
            poses = [pose._replace(yaw_rad=pose.yaw_rad + angle) for angle in angles]
            turned_rad += abs(stage.angle_rad)
        else:
            try:
                plan = planner.make_plan(pose, stage.pose_in_map)  # as the navigator will
            except PlanError as error:
                return f'{subject}: {error}'
            step = max(1, round(STEP_M * costmap.cells_per_m))
            poses = [Pose2D(*point) for point in plan[::step].tolist()]
            length_m += float(np.hypot(*np.diff(plan[:, :2], axis=0).T).sum())
            pose = stage.pose_in_map
        for place in poses:
            if costmap.footprint_cost(place) == IN_OBSTACLE:
                length, width = np.ptp(costmap.footprint.vertices_m, axis=0).tolist()
                outline = f'its outline of {length:.2f} x {width:.2f} m'
                return f'{subject}: at ({place.x_m:.2f}, {place.y_m:.2f}) {outline} touches a wall'
    dwa = navigator.DWAPlannerROS
    speed_mps = min(dwa.max_vel_x, dwa.max_vel_trans, drive.max_linear_speed)
    least_s = length_m / speed_mps + turned_rad / min(test.limits.angular_speed, drive.max_angular_speed)
    if least_s <= test.time_limit:
        return None
    needed = f'its {length_m:.0f} m take it at least {least_s:.0f} s at {speed_mps:g} m/s'
    return f'{subject}: {needed}; time_limit is {test.time_limit:g} s'
