"""When particles are redrawn, and which (section III-C of the paper)."""

from __future__ import annotations

import numpy as np


def normalised(log_weights: np.ndarray) -> np.ndarray:
    """(n,) weights of sum 1."""
    weights = np.exp(log_weights - log_weights.max())
    return weights / weights.sum()


def entropy_of(weights: np.ndarray) -> float:
    """Of the weights as a distribution [nat]: 0 where one particle has all, at most log n."""
    positive = weights[weights > 0.0]
    return float(-(positive * np.log(positive)).sum())


def systematic_indices(weights: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(n,) particles to keep, ascending, each as often as n times its weight, give or take one."""
    count = len(weights)
    marks = (rng.random() + np.arange(count)) / count
    return np.minimum(np.searchsorted(np.cumsum(weights), marks, side='right'), count - 1)
