"""Sampling at the boundaries of a rate, on stamps."""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from diff_encoder_sim.wheels.sampling import BoundarySampler, BoundaryTimes

MS = 1_000_000
TICK_NS = 10 * MS


@given(st.floats(1e-3, 1e6), st.integers(0, 2 * 10**18), st.data())
def test_boundaries_are_exact_for_any_rate(rate, start_ns, data):
    steps_ns = data.draw(st.lists(st.integers(1, max(2, int(3e9 / rate))), max_size=20))
    stamps = [start_ns + sum(steps_ns[:index]) for index in range(len(steps_ns) + 1)]
    exact = Fraction(rate).limit_denominator(10**6) / 10**9
    periods = [stamp * exact // 1 for stamp in stamps]
    sampler = BoundarySampler(rate)
    assert [sampler.period_index(stamp) for stamp in stamps] == [
        period if period not in periods[:index] and (index or stamp * exact == period) else None
        for index, (stamp, period) in enumerate(zip(stamps, periods))
    ]


@pytest.mark.parametrize('rate_hz', [0.3, 1.0, 7.0, 10.0, 15.0, 20.0, 33.3, 50.0, 100.0, 150.0, 200.0, 1e6])
def test_boundary_times_are_the_stamps_that_a_sampler_picks(rate_hz):
    sampler, times = BoundarySampler(rate_hz), BoundaryTimes(rate_hz, TICK_NS)
    newest_ns = None
    for stamp_ns in range(0, 4_000_000_000, TICK_NS):
        if sampler.period_index(stamp_ns) is not None:
            newest_ns = stamp_ns
        assert times.newest_ns(stamp_ns) == newest_ns
