"""What the navigator reports in each control period: command, goal status and phase."""

from __future__ import annotations

import enum
from typing import NamedTuple, Optional


class GoalStatus(enum.Enum):
    """Status of a goal, as in actionlib; the values are for messages to people."""

    NONE = 'no goal'
    ACTIVE = 'active'
    SUCCEEDED = 'goal reached'
    ABORTED = 'aborted'
    PREEMPTED = 'cancelled'

    @property
    def is_over(self) -> bool:
        """Return whether there was a goal and it is no longer pursued."""
        return self not in (GoalStatus.NONE, GoalStatus.ACTIVE)


class Phase(enum.Enum):
    """Phase of an active goal: move_base's states."""

    PLANNING = 'planning'
    CONTROLLING = 'controlling'
    CLEARING = 'clearing'


class Trigger(enum.Enum):
    """Reason for a recovery."""

    PLANNING = 'no plan was found'
    CONTROLLING = 'no velocity command was found'
    OSCILLATION = 'the robot made no progress'


class Command(NamedTuple):
    """Velocity command, as published on /cmd_vel."""

    linear_mps: float
    angular_radps: float


STOP = Command(0.0, 0.0)


class StartedRecovery(NamedTuple):
    """A recovery behaviour that begins."""

    name: str
    number: int  # among all behaviours, from 0
    total: int  # of all behaviours


class NavigatorOutput(NamedTuple):
    """Result of one control period."""

    command: Command  # zero without an active goal, and while the robot must stand
    status: GoalStatus
    phase: Phase  # meaningful while the status is ACTIVE
    text: str  # one line for people: what is being done, or why the goal is over
    started_recovery: Optional[StartedRecovery] = None  # in the period in which a behaviour begins
