"""Counts that are missed, too many, or too fast."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from diff_encoder_sim.wheels.encoder import CountFaults, HitCounts
from diff_encoder_sim.wheels.encoder_params import FaultParams


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


@given(st.lists(st.integers(0, 50), max_size=40), st.floats(1e-6, 1.0), st.floats(1.0, 30.0), st.integers(0, 5))
def test_how_counts_are_split_does_not_matter(parts, fraction, burst, seed):
    whole, split = (HitCounts(fraction, burst, np.random.default_rng(seed)) for _ in range(2))
    assert sum(split.take(part) for part in parts) == whole.take(sum(parts))


def test_missed_and_extra_counts_go_the_way_of_the_wheel():
    assert faults(missed=1.0).counted(-7, 0, 10) == 0
    assert faults(extra=1.0).counted(-7, 0, 10) == -14
    assert faults(extra=1.0).counted(7, 0, 10) == 14
    assert faults(missed=0.5, extra=0.5).counted(0, 0, 10) == 0


def in_ticks(params, number, counts, tick_ns=10_000_000):
    """What the counter gets of equal counts in each of some ticks."""
    return sum(params.counted(counts, tick * tick_ns, (tick + 1) * tick_ns) for tick in range(number))


def test_what_comes_faster_than_the_limit_is_lost():
    assert in_ticks(faults(max_count_rate=1000.0), 100, 30) == 1000
    assert in_ticks(faults(max_count_rate=1000.0), 100, -9) == -900
    assert in_ticks(faults(max_count_rate=30.0), 100, 1) in (29, 30)  # a third of a count each time


@pytest.mark.parametrize('tick_ns', [100_000, 1_000_000, 10_000_000])
@pytest.mark.parametrize('share', [0.1, 0.5, 0.95])
@pytest.mark.parametrize('limit_hz', [50.0, 2000.0])
def test_below_the_limit_nothing_is_lost(tick_ns, share, limit_hz):
    """However many joint states come without a count."""
    counts = [math.floor(share * limit_hz * tick * tick_ns * 1e-9) for tick in range(5000)]
    steps = [(tick, now - before) for tick, (before, now) in enumerate(zip(counts, counts[1:])) if now > before]
    limited = faults(max_count_rate=limit_hz)
    counted = sum(limited.counted(step, tick * tick_ns, (tick + 1) * tick_ns) for tick, step in steps)
    assert counted == counts[-1]
