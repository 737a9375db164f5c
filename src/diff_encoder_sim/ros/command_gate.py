"""When a velocity command takes effect: at once, or at a fixed simulated time."""

from __future__ import annotations

import logging
import threading
from collections import deque
from typing import Callable, Deque, Optional, Tuple

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.ros.expected_stamps import AnsweredTimes

log = logging.getLogger(__name__)

Command = Tuple[float, float]  # linear [m/s], angular [rad/s]
STANDSTILL: Command = (0.0, 0.0)
IDLE_PATIENCE_S = 0.02  # of wall time


class CommandGate:
    """Lets one command through for each report that a controller answers, at the same simulated time in every run.

    Commands have no stamp, and how long one takes to arrive depends on the host and its load. A controller that answers
    a report with one command is waited for, and its command takes effect `delay_ns` after the report: so a run can be
    repeated exactly. Without `answered_times` commands take effect as they come.
    """

    def __init__(
        self,
        answered_times: Optional[AnsweredTimes],
        delay_ns: int,
        patience_s: float,
        is_expected: Callable[[], bool],
        is_from_start: bool,
    ) -> None:
        """Prepare to wait for a controller.

        Args:
            answered_times: of the reports that it answers.
            delay_ns: from a report to the moment when its answer takes effect.
            patience_s: how long to wait for an answer, by the wall clock.
            is_expected: whether a controller is connected at all.
            is_from_start: whether it answers the first report already.
        """
        self._answered_times = answered_times
        self._delay_ns = delay_ns
        self._patience_s = patience_s
        self._is_expected = is_expected
        self._arrived = threading.Condition()
        self._commands: Deque[Command] = deque()
        self._report_ns: Optional[int] = None  # the newest whose answer was taken
        self._is_waited_for = True
        self._is_moving = False
        self._is_first = is_from_start

    def put(self, command: Command) -> None:
        """Take a command from the controller."""
        with self._arrived:
            self._commands.append(command)
            self._is_waited_for = True
            self._arrived.notify_all()

    def clear(self) -> None:
        """Forget what has not taken effect: after a reset."""
        with self._arrived:
            self._commands.clear()
            self._report_ns = None
            if self._answered_times is not None:
                self._answered_times.restart()

    def take(self, sim_time_ns: int) -> Optional[Command]:
        """Return the command that takes effect at `sim_time_ns`, if any; may block to wait for it."""
        with self._arrived:
            if self._answered_times is not None:
                if not self._is_open(self._answered_times, sim_time_ns - self._delay_ns):
                    return None
                self._wait(sim_time_ns)
            if not self._commands:
                return None
            newest = self._commands.pop()
            self._commands.clear()
            self._is_moving = newest != STANDSTILL
            return newest

    def _is_open(self, times: AnsweredTimes, report_ns: int) -> bool:
        if report_ns < 0 or not times.is_answered(report_ns):
            return False
        # The answer to a report that came within the delay may have been taken, as the newest, with the one before.
        if self._report_ns is not None and report_ns - self._report_ns <= self._delay_ns:
            return False
        self._report_ns = report_ns
        return True

    def _wait(self, sim_time_ns: int) -> None:
        if self._commands or not (self._is_waited_for and self._is_expected()):
            return
        # While the robot stands, between one goal and the next, there may be no controller to wait for.
        patience_s = self._patience_s if self._is_moving or self._is_first else IDLE_PATIENCE_S
        self._is_first = False
        if not self._arrived.wait_for(lambda: bool(self._commands), patience_s):
            self._is_waited_for = False
            if self._is_moving:
                log.warning(
                    'no velocity command within %.1f s of wall time at simulated time %.2f s: continuing without it',
                    patience_s,
                    sim_time_ns / NANOSECONDS_PER_SECOND,
                )
