"""Sampling at the boundaries of a rate, on stamps."""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from diff_encoder_sim.wheels.sampling import BoundarySampler, BoundaryTimes

MS = 1_000_000
TICK_NS = 10 * MS


def stamps_sampled(rate, stamps):
    sampler = BoundarySampler(rate)
    return [stamp for stamp in stamps if sampler.period_index(stamp) is not None]


def test_samples_are_the_first_at_or_after_each_boundary():
    assert stamps_sampled(20, [0, 20 * MS, 40 * MS, 60 * MS, 80 * MS, 100 * MS, 120 * MS]) == [0, 60 * MS, 100 * MS]


def test_the_first_stamp_off_a_boundary_only_opens_its_period():
    assert stamps_sampled(20, [13 * MS, 33 * MS, 53 * MS, 73 * MS]) == [53 * MS]


def test_boundaries_do_not_drift_in_an_hour_of_a_rate_that_is_no_whole_period():
    stamps = range(0, 3600 * 10**9, 10**9 // 100)
    assert len(stamps_sampled(30, stamps)) == 3600 * 30


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


@given(st.lists(st.integers(1, 200), min_size=5, max_size=60))
def test_no_period_is_sampled_twice_and_none_with_a_stamp_is_left_out(steps_ms):
    stamps = [sum(steps_ms[:index]) * MS for index in range(len(steps_ms))]
    periods = [stamp // (50 * MS) for stamp in stamps_sampled(20, stamps)]
    assert periods == sorted({stamp // (50 * MS) for stamp in stamps})


@pytest.mark.parametrize('rate_hz', [0.3, 1.0, 7.0, 10.0, 15.0, 20.0, 33.3, 50.0, 100.0, 150.0, 200.0, 1e6])
def test_boundary_times_are_the_stamps_that_a_sampler_picks(rate_hz):
    sampler, times = BoundarySampler(rate_hz), BoundaryTimes(rate_hz, TICK_NS)
    newest_ns = None
    for stamp_ns in range(0, 4_000_000_000, TICK_NS):
        if sampler.period_index(stamp_ns) is not None:
            newest_ns = stamp_ns
        assert times.newest_ns(stamp_ns) == newest_ns


def test_there_are_no_boundary_times_before_time_begins():
    assert all(BoundaryTimes(rate_hz, TICK_NS).newest_ns(-TICK_NS) < 0 for rate_hz in (7.0, 20.0, 200.0))


def test_boundary_times_do_not_drift_in_a_day():
    day_ns = 24 * 3600 * 1_000_000_000
    assert BoundaryTimes(20.0, TICK_NS).newest_ns(day_ns) == day_ns
    assert BoundaryTimes(20.0, TICK_NS).newest_ns(day_ns - TICK_NS) == day_ns - 50_000_000
