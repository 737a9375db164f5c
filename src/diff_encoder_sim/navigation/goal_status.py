"""What the navigator answers each control period."""

from __future__ import annotations

import enum
from typing import NamedTuple


class GoalStatus(enum.Enum):
    """How the goal stands, in the words of actionlib."""

    NONE = 'no goal'
    ACTIVE = 'on the way'
    SUCCEEDED = 'reached'
    ABORTED = 'given up'
    PREEMPTED = 'cancelled'

    @property
    def is_over(self) -> bool:
        """Whether there was a goal and nothing is done for it any more."""
        return self not in (GoalStatus.NONE, GoalStatus.ACTIVE)


class Phase(enum.Enum):
    """What is being done for an active goal: move_base's states."""

    PLANNING = 'planning'
    CONTROLLING = 'controlling'
    CLEARING = 'clearing'


class Trigger(enum.Enum):
    """Why recovery was called."""

    PLANNING = 'no plan was found'
    CONTROLLING = 'no velocity command was found'
    OSCILLATION = 'the robot did not get on'


class Command(NamedTuple):
    """What /cmd_vel is to say."""

    linear_mps: float
    angular_radps: float


STOP = Command(0.0, 0.0)


class NavigatorOutput(NamedTuple):
    """One control period's result."""

    command: Command  # zero whenever there is nothing to drive for, or no safe way to
    status: GoalStatus
    phase: Phase  # has a meaning while the status is ACTIVE
    text: str  # one line for people: what is going on, or why it is over
