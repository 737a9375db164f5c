"""The particles' weights, and systematic resampling by them (section III-C of the paper)."""

from __future__ import annotations

import numpy as np


def normalised(log_weights: np.ndarray) -> np.ndarray:
    """Return (n,) weights of sum 1 from their logarithms up to a constant."""
    weights = np.exp(log_weights - log_weights.max())
    normalised_weights: np.ndarray = weights / weights.sum()
    return normalised_weights


def entropy_of(weights: np.ndarray) -> float:
    """Return the weights' entropy [nat]: 0 if one particle has all weight, at most log n."""
    positive = weights[weights > 0.0]
    return float(-(positive * np.log(positive)).sum())


def systematic_indices(weights: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Draw (n,) particles to keep, ascending, each n times its weight times, plus or minus one."""
    count = len(weights)
    marks = (rng.random() + np.arange(count)) / count
    return np.minimum(np.searchsorted(np.cumsum(weights), marks, side='right'), count - 1)
