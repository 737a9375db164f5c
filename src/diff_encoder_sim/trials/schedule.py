"""Simulated time as a queue of actions: at their rates, or after a latency."""

from __future__ import annotations

import heapq
from typing import Callable, List, Tuple

from typing_extensions import Protocol

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.navigation.navigator_inputs import STOP, Command, GoalStatus, NavigatorOutput, Phase

Action = Callable[[], None]


class Schedule:
    """Actions by time [ns], those of one time in a fixed order.

    First those at a rate, then those entered by `at`, each in the order in which they were entered.
    """

    def __init__(self) -> None:
        # (time [ns], rank among those of one time, period [ns] or 0, action); ranks are unique.
        self._queue: List[Tuple[int, Tuple[int, int], int, Action]] = []
        self._count = 0

    def every(self, period_ns: int, action: Action) -> None:
        """Enter an action for 0 and every multiple of the period."""
        self._push(0, 0, period_ns, action)

    def at(self, time_ns: int, action: Action) -> None:
        """Enter an action for one time."""
        self._push(time_ns, 1, 0, action)

    def clear(self) -> None:
        """Remove all actions."""
        self._queue.clear()

    def run_until(self, time_ns: int) -> None:
        """Run all actions up to and including a time; they may enter more."""
        queue = self._queue
        while queue and queue[0][0] <= time_ns:
            due_ns, rank, period_ns, action = queue[0]
            if period_ns:
                heapq.heapreplace(queue, (due_ns + period_ns, rank, period_ns, action))
            else:
                heapq.heappop(queue)
            action()

    def _push(self, time_ns: int, kind: int, period_ns: int, action: Action) -> None:
        self._count += 1
        heapq.heappush(self._queue, (time_ns, (kind, self._count), period_ns, action))


NO_NAVIGATION = NavigatorOutput(STOP, GoalStatus.NONE, Phase.PLANNING, '')

# Publishes a command at a time [ns]; True: it is the navigator's.
SendCommand = Callable[[int, Command, bool], None]


class Driver(Protocol):
    """Drives a robot: takes what its nodes would subscribe to, and sends commands."""

    @property
    def is_over(self) -> bool:
        """Return whether the robot rests at the end of the drive."""

    def take_time(self, now_ns: int) -> None:
        """Act on the time of a /world_pose; its pose is not for the driver. Raises RouteFailed."""

    def take_scan(self, scan: Scan) -> None:
        """Take a /scan."""
