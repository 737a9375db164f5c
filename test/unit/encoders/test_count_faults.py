"""Counts that are missed, too many, or too fast."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from diff_encoder_sim.encoders.count_faults import CountFaults, HitCounts
from diff_encoder_sim.encoders.encoder_model import FaultParams


def faults(seed=1, **keys):
    return CountFaults(FaultParams.from_mapping(keys, 'faults'), np.random.default_rng(seed))


@pytest.mark.parametrize(('fraction', 'burst'), [(0.01, 1.0), (0.3, 1.0), (1.0, 1.0), (0.05, 20.0)])
def test_the_fraction_is_chosen_in_bursts(fraction, burst):
    hits = HitCounts(fraction, burst, np.random.default_rng(1))
    chosen = np.array([hits.take(1) for _ in range(200_000)])
    assert chosen.mean() == pytest.approx(fraction, rel=0.1)
    lengths = np.diff(np.flatnonzero(np.diff(np.r_[0, chosen, 0])))[::2]
    if fraction < 0.1:
        assert lengths.mean() == pytest.approx(burst, rel=0.1)


def test_single_misses_are_independent_of_each_other():
    """Binomial: the variance of a sum of n is n p (1 - p)."""
    hits = HitCounts(0.1, 1.0, np.random.default_rng(2))
    sums = np.array([hits.take(100) for _ in range(4000)])
    assert sums.var() == pytest.approx(100 * 0.1 * 0.9, rel=0.1)


@given(st.lists(st.integers(0, 50), max_size=40), st.floats(1e-6, 1.0), st.floats(1.0, 30.0), st.integers(0, 5))
def test_how_counts_are_split_does_not_matter(parts, fraction, burst, seed):
    whole, split = (HitCounts(fraction, burst, np.random.default_rng(seed)) for _ in range(2))
    assert sum(split.take(part) for part in parts) == whole.take(sum(parts))


def test_missed_and_extra_counts_go_the_way_of_the_wheel():
    assert faults(missed=1.0).counted(-7, 10) == 0
    assert faults(extra=1.0).counted(-7, 10) == -14
    assert faults(extra=1.0).counted(7, 10) == 14
    assert faults(missed=0.5, extra=0.5).counted(0, 10) == 0


def test_what_comes_faster_than_the_limit_is_lost():
    limited = faults(max_count_rate=1000.0)
    assert sum(limited.counted(30, 10_000_000) for _ in range(100)) == 1000
    assert sum(limited.counted(-9, 10_000_000) for _ in range(100)) == -900
    slow = faults(max_count_rate=30.0)  # a third of a count each time
    assert sum(slow.counted(1, 10_000_000) for _ in range(100)) in (29, 30)
