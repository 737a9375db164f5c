"""Where to go: one goal, or waypoints that are passed on the way to it."""
from __future__ import annotations

import contextlib
import math
from typing import Callable, Iterator, List, Sequence

import numpy as np

from diff_encoder_sim.navigation.plan_error import PlanError
from diff_encoder_sim.se2 import Pose2D

# (start, goal) to a plan (n, 3), raising PlanError.
MakePlan = Callable[[Pose2D, Pose2D], np.ndarray]

# A path's direction at a waypoint is taken over so many of its points: one is but a cell's corner.
DIRECTION_POINTS = 10


class Route:
    """Poses in the map frame; all but the last are passed without stopping.

    The plan leads past the next waypoint to the one after, so that the local planner sees no end
    to slow down for. Only where the route turns back sharply does it end at the waypoint: with
    both ways in sight, the end of the second could be where the robot stands already.
    """

    def __init__(self, poses: Sequence[Pose2D], pass_radius_m: float = 0.0) -> None:
        self.poses: List[Pose2D] = list(poses)
        self._pass_radius_m = pass_radius_m
        self.next_index = 0
        self._planned_to = 0           # index of the pose where the plan ends
        self._last_leg = np.empty((0, 3))
        self._points_beyond = 0        # of the plan, after the target

    @property
    def target(self) -> Pose2D:
        """The pose that the robot is on its way to."""
        return self.poses[self.next_index]

    @property
    def is_last(self) -> bool:
        """Whether the target is the goal."""
        return self.next_index == len(self.poses) - 1

    def describe(self) -> str:
        """The target in words."""
        if len(self.poses) == 1:
            return 'the goal'
        return f'waypoint {self.next_index + 1} of {len(self.poses)}'

    def check(self, check_goal: Callable[[Pose2D], None]) -> None:
        """Look at all poses that are left, before the robot starts for one that is not.

        Raises:
            PlanError: `check_goal` raised it; the text names the waypoint.
        """
        for index in range(self.next_index, len(self.poses)):
            with self._naming(index):
                check_goal(self.poses[index])

    def plan(self, start: Pose2D, make_plan: MakePlan) -> np.ndarray:
        """(n, 3) from the robot over the target to the waypoint after it.

        Raises:
            PlanError: there is no way; the text names the waypoint.
        """
        while not self.is_last and self._is_near(start):
            self.next_index += 1
        first = self._leg(start, self.next_index, make_plan)
        self._planned_to = self.next_index
        beyond = self._leg_beyond(make_plan)
        self._points_beyond = sum(map(len, beyond))
        return np.vstack([first, *beyond])

    def advance(self, base_pose: Pose2D, points_left: int) -> bool:
        """Go on to the next pose if the target is passed; False if it is not.

        It is passed within the radius, and also where the robot, having cut the corner, is
        nearest to a point of the plan beyond it: it would turn round for nothing.

        Args:
            base_pose: the robot.
            points_left: of the plan, from the one nearest to the robot.
        """
        if self.is_last or not (self._is_near(base_pose) or points_left <= self._points_beyond):
            return False
        self.next_index += 1
        return True

    @property
    def plan_goes_on(self) -> bool:
        """Whether the plan made last leads to the target, after an advance."""
        return self._planned_to >= self.next_index

    def plan_beyond(self, make_plan: MakePlan) -> np.ndarray:
        """(n, 3) what to add to the plan that ends at the target; n = 0 at the goal.

        Raises:
            PlanError: there is no way on.
        """
        beyond = self._leg_beyond(make_plan)
        self._points_beyond = sum(map(len, beyond))
        return np.vstack([np.empty((0, 3)), *beyond])

    def _is_near(self, base_pose: Pose2D) -> bool:
        return math.hypot(self.target.x_m - base_pose.x_m,
                          self.target.y_m - base_pose.y_m) <= self._pass_radius_m

    def _leg_beyond(self, make_plan: MakePlan) -> List[np.ndarray]:
        """The way from where the plan ends to the pose after it, if it goes on about straight."""
        if self._planned_to == len(self.poses) - 1:
            return []
        before = self._last_leg
        beyond = self._leg(self.poses[self._planned_to], self._planned_to + 1, make_plan)
        if not _goes_on(before, beyond):
            self._last_leg = before
            return []
        self._planned_to += 1
        return [beyond[1:]]

    def _leg(self, start: Pose2D, index: int, make_plan: MakePlan) -> np.ndarray:
        with self._naming(index):
            self._last_leg = make_plan(start, self.poses[index])
        return self._last_leg

    @contextlib.contextmanager
    def _naming(self, index: int) -> Iterator[None]:
        """What goes wrong with a pose of several is said with its number."""
        try:
            yield
        except PlanError as error:
            if len(self.poses) == 1:
                raise
            raise PlanError(error.problem,
                            f'waypoint {index + 1} of {len(self.poses)}: {error}') from None


def _goes_on(before: np.ndarray, beyond: np.ndarray) -> bool:
    """Whether the second of two plans that meet turns by less than a right angle from the first."""
    arriving = before[-1, :2] - before[max(0, len(before) - 1 - DIRECTION_POINTS), :2]
    leaving = beyond[min(DIRECTION_POINTS, len(beyond) - 1), :2] - beyond[0, :2]
    return float(arriving @ leaving) > 0.0
