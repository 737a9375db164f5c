"""Takes a robot along a test's route: goals for the navigator one by one, turns by itself."""

from __future__ import annotations

import logging
import math
from typing import List, NamedTuple, Optional, Union

from diff_encoder_sim.base.errors import EVENT
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.navigation.goal_status import GoalStatus
from diff_encoder_sim.trials.scripted_drive import SETTLING_S
from diff_encoder_sim.trials.trial_definition import Leg, TestDefinition
from diff_encoder_sim.trials.trial_outcome import Outcome, RouteFailed
from diff_encoder_sim.trials.turn_in_place import TurnInPlace

# A robot that turns is stopped when its newest belief is older; the navigator's default, too.
POSE_TIMEOUT_S = 0.5

log = logging.getLogger(__name__)


class Destination(NamedTuple):
    """A pose to send to the navigator."""

    pose_in_map: Pose2D
    is_stop: bool  # False: a waypoint, left for the next one as soon as it is near

    def describe(self) -> str:
        """In words, for messages."""
        if self.is_stop:
            return 'the goal'
        return f'the waypoint ({self.pose_in_map.x_m:.2f}, {self.pose_in_map.y_m:.2f})'


class DriverOutput(NamedTuple):
    """What the driver wants now."""

    goal_in_map: Optional[Pose2D] = None  # for the navigator, in place of its present one
    turn_rate_radps: Optional[float] = None  # for /cmd_vel; None: the navigator is in charge


class RouteDriver:
    """Call `step` with each belief of where the robot is, until it `is_over`; and `watch` always.

    Where the robot is, it knows from localization alone, as the robot does.
    """

    def __init__(self, test: TestDefinition) -> None:
        self._test = test
        self._stages = _stages(test)
        self._index = -1
        self._turn: Optional[TurnInPlace] = None
        self._reached_ns: Optional[int] = None
        self._started_ns: Optional[int] = None
        self._estimate_ns = 0
        self._is_halted = False
        self.is_over = False

    def watch(self, now_ns: int) -> DriverOutput:
        """To be called at a steady rate, whether the robot knows where it is or not.

        Returns:
            A stop, while the robot turns and no belief has come for POSE_TIMEOUT_S.

        Raises:
            RouteFailed: the test's time limit, from the first call on, is over.
        """
        if self._started_ns is None:
            self._started_ns = now_ns
        if now_ns - self._started_ns > self._test.time_limit * NANOSECONDS_PER_SECOND:
            raise RouteFailed(Outcome.TIMED_OUT, f'not at its end after {self._test.time_limit:.0f} s (time_limit)')
        age_s = (now_ns - self._estimate_ns) / NANOSECONDS_PER_SECOND
        if self._turn is None or age_s <= POSE_TIMEOUT_S:
            return DriverOutput()
        if not self._is_halted:
            log.warning('the pose is %.1f s old: stopped turning', age_s, extra=EVENT)
        self._is_halted = True
        self._turn.halt()
        return DriverOutput(turn_rate_radps=0.0)

    def step(self, now_ns: int, base_pose_in_map: Pose2D, status: GoalStatus, status_text: str) -> DriverOutput:
        """What to do now.

        Args:
            now_ns: stamp of the pose.
            base_pose_in_map: where the robot believes to be.
            status: how the goal sent last stands with the navigator.
            status_text: its reason, for messages.

        Raises:
            RouteFailed: the navigator gave a goal up.
        """
        self._estimate_ns = now_ns
        if self._is_halted:
            log.info('the pose is back: turning on', extra=EVENT)
            self._is_halted = False
        if self._index < 0:
            return self._begin_next(now_ns, base_pose_in_map)
        if self._reached_ns is not None:
            self.is_over = now_ns - self._reached_ns >= SETTLING_S * NANOSECONDS_PER_SECOND
            return DriverOutput()
        if self._turn is not None:
            return self._go_on_turning(now_ns, base_pose_in_map)
        if self._is_done(self._stages[self._index], base_pose_in_map, status, status_text):
            return self._begin_next(now_ns, base_pose_in_map)
        return DriverOutput()

    def _begin_next(self, now_ns: int, base_pose_in_map: Pose2D) -> DriverOutput:
        self._index += 1
        if self._index == len(self._stages):
            self._reached_ns = now_ns
            return DriverOutput()
        stage = self._stages[self._index]
        if isinstance(stage, Destination):
            return DriverOutput(goal_in_map=stage.pose_in_map)
        self._turn = TurnInPlace(stage, self._test.limits)
        return self._go_on_turning(now_ns, base_pose_in_map)

    def _go_on_turning(self, now_ns: int, base_pose_in_map: Pose2D) -> DriverOutput:
        rate_radps = self._turn.rate(now_ns, base_pose_in_map.yaw_rad)
        if not self._turn.is_over:
            return DriverOutput(turn_rate_radps=rate_radps)
        self._turn = None
        return self._begin_next(now_ns, base_pose_in_map)._replace(turn_rate_radps=rate_radps)

    def _is_done(self, stage: Destination, base_pose_in_map: Pose2D, status: GoalStatus, status_text: str) -> bool:
        offset_m = math.hypot(
            base_pose_in_map.x_m - stage.pose_in_map.x_m, base_pose_in_map.y_m - stage.pose_in_map.y_m
        )
        if not stage.is_stop and offset_m <= self._test.pass_radius:
            return True
        if status.is_over and status is not GoalStatus.SUCCEEDED:
            raise RouteFailed(Outcome.ABORTED, f'{stage.describe()} was not reached: {status_text or status.value}')
        return status is GoalStatus.SUCCEEDED


def _stages(test: TestDefinition) -> List[Union[Destination, float]]:
    """Destinations, and turns in place [rad], in the order of the test."""
    return [stage for leg in test.route for stage in _stages_of(leg)]


def _stages_of(leg: Leg) -> List[Union[Destination, float]]:
    if leg.turns is not None:
        return [2.0 * math.pi * leg.turns]
    if leg.goal is not None:
        return [Destination(leg.goal.pose(), True)]
    points = [(point.x, point.y) for point in leg.through]
    # Of a waypoint the heading has no meaning, but a navigator that gets there should look ahead.
    ahead = points[1:] + points[-1:]
    return [
        Destination(Pose2D(*point, math.atan2(after[1] - point[1], after[0] - point[0])), False)
        for point, after in zip(points, ahead)
    ]
