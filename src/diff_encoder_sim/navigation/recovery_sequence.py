"""Sequence of recovery behaviours: which one is next, and what they were called for."""

from __future__ import annotations

from typing import List, Optional

from diff_encoder_sim.navigation.goal_status import StartedRecovery, Trigger
from diff_encoder_sim.navigation.recovery import Recovery, RecoveryStep, RecoveryView


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
