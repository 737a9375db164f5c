"""What takes too much of a tolerance, whatever the encoder."""

from __future__ import annotations

from typing import List, Mapping

import numpy as np

from diff_encoder_sim.advice.answers import Limit
from diff_encoder_sim.advice.requirement import Requirement

# A cause that takes more of the tolerance than this leaves too little for the others.
MOST_BY_ONE_CAUSE = 0.5


def limits(alone: Mapping[str, Mapping[str, np.ndarray]], requirement: Requirement) -> List[Limit]:
    """Return the causes that are limits, the worst first, each where it is worst.

    Args:
        alone: by cause and test, (n, 3) errors by the axes of budgets that the cause makes by itself.
        requirement: whose share of the trials is looked at.
    """
    worst = [limit for cause, of_tests in alone.items() for limit in _worst(cause, of_tests, requirement)]
    found = [limit for limit in worst if limit.error > limit.reduced_to]
    return sorted(found, key=lambda limit: -limit.error / limit.tolerance)


def worst_halved(alone: Mapping[str, Mapping[str, np.ndarray]], requirement: Requirement) -> List[Limit]:
    """Return the worst cause, as `limits` does, however small it is, with half of it as what is left; or nothing."""
    worst = [limit for cause, of_tests in alone.items() for limit in _worst(cause, of_tests, requirement)]
    worst.sort(key=lambda limit: -limit.error / limit.tolerance)
    return [limit._replace(reduced_to=0.5 * limit.error) for limit in worst[:1]]


def _worst(cause: str, of_tests: Mapping[str, np.ndarray], requirement: Requirement) -> List[Limit]:
    """Return where a cause takes most; nothing where there are no errors."""
    every = [
        Limit(
            cause, test, axis, float(error), float(tolerance), min(float(error), MOST_BY_ONE_CAUSE * float(tolerance))
        )
        for test, errors in of_tests.items()
        if len(errors)
        for axis, (error, tolerance) in enumerate(
            zip(np.quantile(np.abs(errors), requirement.share, axis=0), requirement.tolerances)
        )
    ]
    return sorted(every, key=lambda limit: -limit.error / limit.tolerance)[:1]
