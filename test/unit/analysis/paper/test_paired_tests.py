"""Pairs of errors of equal trials."""

import numpy as np

from diff_encoder_sim.analysis.paper.claims import (
    Conclusion,
    Pair,
    first_errs_more,
    first_spreads_more,
    fractions_equal,
)
from diff_encoder_sim.analysis.quantities import X

HOLDS, FAILS, UNCLEAR = Conclusion.HOLDS, Conclusion.FAILS, Conclusion.UNCLEAR


def conclusions(tests):
    return [test.conclusion for test in tests]


def normal(count, spread=1.0, mean=0.0, seed=0):
    return np.random.default_rng(seed).normal(mean, spread, count)


def pair(first, second, quantity=X):
    return Pair('a pair', ('40 PPR', '4096 PPR'), (np.asarray(first), np.asarray(second)), quantity)


def test_spreads_of_pairs():
    wide, narrow = normal(30, 3.0, seed=1), normal(30, 1.0, seed=2)
    assert conclusions(first_spreads_more([pair(wide, narrow)])) == [HOLDS]
    assert conclusions(first_spreads_more([pair(narrow, wide)])) == [FAILS]
    assert conclusions(first_spreads_more([pair(wide, normal(30, 3.0, seed=3))])) == [UNCLEAR]
    assert conclusions(first_spreads_more([pair(wide[:2], narrow[:2])])) == [UNCLEAR]


def test_sizes_of_pairs():
    far, near = normal(30, 0.1, mean=1.0, seed=1), normal(30, 0.1, mean=0.5, seed=2)
    assert conclusions(first_errs_more([pair(-far, near)])) == [HOLDS]
    assert conclusions(first_errs_more([pair(near, far)])) == [FAILS]
    assert conclusions(first_errs_more([pair(near, normal(30, 0.1, 0.5, seed=3))])) == [UNCLEAR]


def test_equal_fractions():
    inside, outside = np.zeros(30), np.ones(30)
    assert conclusions(fractions_equal([pair(inside, inside)])) == [HOLDS]
    assert conclusions(fractions_equal([pair(inside, outside)])) == [FAILS]
    assert conclusions(fractions_equal([pair(inside[:10], inside[:10])])) == [UNCLEAR]
    assert conclusions(fractions_equal([pair([], [])])) == [UNCLEAR]
