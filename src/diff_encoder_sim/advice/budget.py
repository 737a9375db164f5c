"""An error budget: what each cause adds to the error at the goal, beside the error that is found."""

from __future__ import annotations

from typing import Dict, NamedTuple

import numpy as np

# The axes of all budgets: along the heading at the goal, across it to the left, and the heading itself.
AXES = ('along', 'across', 'heading')


class Part(NamedTuple):
    """(3,) mean and variance by AXES: [m], [m], [rad]; [m^2], [m^2], [rad^2]."""

    bias: np.ndarray
    variance: np.ndarray

    @property
    def std(self) -> np.ndarray:
        """(3,) standard deviation; negative where a rest takes away from the others."""
        std: np.ndarray = np.sign(self.variance) * np.sqrt(np.abs(self.variance))
        return std


class Budget(NamedTuple):
    """Causes, which are independent of each other, and their sum."""

    parts: Dict[str, Part]  # by cause
    found: Part

    @property
    def rest(self) -> Part:
        """Return what was found less what the causes add up to."""
        return Part(
            self.found.bias - sum(part.bias for part in self.parts.values()),
            self.found.variance - sum(part.variance for part in self.parts.values()),
        )


def part_of(errors: np.ndarray) -> Part:
    """Return mean and variance of (n, 3) errors by AXES."""
    return Part(errors.mean(axis=0), errors.var(axis=0, ddof=1) if len(errors) > 1 else np.zeros(3))


def added(errors: np.ndarray, without: np.ndarray) -> Part:
    """Return what a cause adds: (n, 3) errors with it, less paired ones without it."""
    return Part(errors.mean(axis=0) - without.mean(axis=0), errors.var(axis=0, ddof=1) - without.var(axis=0, ddof=1))
