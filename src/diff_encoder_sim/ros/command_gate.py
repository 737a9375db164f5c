"""When a velocity command takes effect: at once, or at a fixed simulated time."""

from __future__ import annotations

import logging
import threading
from collections import deque
from typing import Callable, Deque, Optional, Tuple

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND

log = logging.getLogger(__name__)

Command = Tuple[float, float]  # linear [m/s], angular [rad/s]
STANDSTILL: Command = (0.0, 0.0)
IDLE_PATIENCE_S = 0.02  # of wall time


class CommandGate:
    """Lets commands through once a period, at the same simulated time in every run.

    Commands have no stamp, and how long one is on its way depends on the machine. A controller
    that answers each boundary of the period with one command is waited for, and its answer takes
    effect `delay_ns` after the boundary: so a run can be repeated exactly. With a period of 0
    commands take effect as they come.
    """

    def __init__(
        self, period_ns: int, delay_ns: int, patience_s: float, is_expected: Callable[[], bool], is_from_start: bool
    ) -> None:
        """Args:
        period_ns: of the controller.
        delay_ns: from a boundary to the moment when its answer takes effect.
        patience_s: how long to wait for an answer, by the wall clock.
        is_expected: whether a controller is connected at all.
        is_from_start: whether it answers the first boundary already.
        """
        self._period_ns = period_ns
        self._delay_ns = delay_ns
        self._patience_s = patience_s
        self._is_expected = is_expected
        self._arrived = threading.Condition()
        self._commands: Deque[Command] = deque()
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

    def take(self, sim_time_ns: int) -> Optional[Command]:
        """The command that takes effect at `sim_time_ns`, if any; may block to wait for it."""
        with self._arrived:
            if self._period_ns:
                if sim_time_ns % self._period_ns != self._delay_ns:
                    return None
                self._wait(sim_time_ns)
            if not self._commands:
                return None
            newest = self._commands.pop()
            self._commands.clear()
            self._is_moving = newest != STANDSTILL
            return newest

    def _wait(self, sim_time_ns: int) -> None:
        if self._commands or not (self._is_waited_for and self._is_expected()):
            return
        # Of a robot at rest nobody may be in charge, between one goal and the next.
        patience_s = self._patience_s if self._is_moving or self._is_first else IDLE_PATIENCE_S
        self._is_first = False
        if not self._arrived.wait_for(lambda: bool(self._commands), patience_s):
            self._is_waited_for = False
            if self._is_moving:
                log.warning(
                    'no velocity command for %.2f s of simulated time: going on without',
                    sim_time_ns / NANOSECONDS_PER_SECOND,
                )
