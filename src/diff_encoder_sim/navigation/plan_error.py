"""Why there is no plan."""

from __future__ import annotations

import enum


class PlanProblem(enum.Enum):
    """What stands in the way."""

    NOT_FINITE = 'a coordinate is no number'
    OUTSIDE = 'outside the map'
    IN_WALL = 'in a wall of the static map'
    BLOCKED = 'in an obstacle'
    UNREACHABLE = 'no way there'

    @property
    def is_lasting(self) -> bool:
        """Whether waiting or clearing obstacles cannot help."""
        return self in (PlanProblem.NOT_FINITE, PlanProblem.OUTSIDE, PlanProblem.IN_WALL)


class PlanError(ValueError):
    """There is no plan; the text says which pose and why, in one line."""

    def __init__(self, problem: PlanProblem, text: str) -> None:
        super().__init__(text)
        self.problem = problem
