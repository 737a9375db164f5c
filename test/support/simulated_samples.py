"""Samples whose truth is known, and how often intervals may miss it by chance."""

import math

import numpy as np
from scipy import stats

TRIALS = 30


def contaminated(rng, size):
    """One value in twenty is five times as far off; variance 1."""
    return rng.normal(0.0, np.where(rng.random(size) < 0.05, 5.0, 1.0)) / math.sqrt(0.95 + 0.05 * 25.0)


DRAWS = {
    'normal': lambda rng, size: rng.normal(0.0, 1.0, size),
    'uniform': lambda rng, size: rng.uniform(-math.sqrt(3.0), math.sqrt(3.0), size),
    'laplace': lambda rng, size: rng.laplace(0.0, math.sqrt(0.5), size),
    'contaminated': contaminated,
}


def fraction_covering(intervals, truth):
    return np.mean([interval.low <= truth <= interval.high for interval in intervals])


def chance_range(fraction, repetitions):
    """Limits between which 999 of 1000 simulated fractions lie."""
    return tuple(stats.binom.ppf([0.0005, 0.9995], repetitions, fraction) / repetitions)


def is_near(simulated, fraction, repetitions):
    low, high = chance_range(fraction, repetitions)
    return low <= simulated <= high
