"""Reasons why no plan was found."""

from __future__ import annotations

import enum


class PlanProblem(enum.Enum):
    """Kinds of failure to plan."""

    NOT_FINITE = 'a coordinate is not finite'
    OUTSIDE = 'outside the map'
    IN_WALL = 'in a wall of the static map'
    BLOCKED = 'in an obstacle'
    UNREACHABLE = 'no path to the goal'

    @property
    def is_lasting(self) -> bool:
        """Return whether neither waiting nor clearing obstacles can help."""
        return self in (PlanProblem.NOT_FINITE, PlanProblem.OUTSIDE, PlanProblem.IN_WALL)


class PlanError(ValueError):
    """No plan was found; the text names the pose and the reason in one line."""

    def __init__(self, problem: PlanProblem, text: str) -> None:
        super().__init__(text)
        self.problem = problem
