"""Reports of a controller: sampled at the boundaries of a rate, their way to the host, and their speeds."""

import random
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from diff_encoder_sim.wheels.report_link import BoundarySampler, EncoderSample, ReportLink, ReportParams, SpeedPairing

MS = 1_000_000
TICK_NS, PERIOD_NS = 10 * MS, 50 * MS


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
    sampler, times = BoundarySampler(rate_hz), BoundarySampler(rate_hz, TICK_NS)
    newest_ns = None
    for stamp_ns in range(0, 4_000_000_000, TICK_NS):
        if sampler.period_index(stamp_ns) is not None:
            newest_ns = stamp_ns
        assert times.newest_ns(stamp_ns) == newest_ns


def arrivals(count=2000, tick_ms=10, seed=1, **keys):
    """When each sample arrived [ns], and the samples, one sent each period."""
    link = ReportLink(ReportParams.from_mapping(keys, 'report'), PERIOD_NS * 1e-9, seed)
    found = []
    for now_ns in range(0, count * PERIOD_NS, tick_ms * MS):
        index, rest = divmod(now_ns, PERIOD_NS)
        sent = [EncoderSample(now_ns, index, -index)] if rest == 0 else []
        found += [(now_ns, sample) for sample in link.pass_on(now_ns, sent)]
    return found


@pytest.mark.parametrize(('stamps', 'late_ms'), [('sample', 0), ('arrival', 25)])
def test_a_late_sample_has_its_own_time_or_that_of_its_arrival(stamps, late_ms):
    for now_ns, sample in arrivals(20, latency=0.025, stamps=stamps):
        assert now_ns == sample.left_pulses * PERIOD_NS + 30 * MS  # at the next tick
        assert sample.stamp_ns == sample.left_pulses * PERIOD_NS + late_ms * MS


def test_the_latency_is_spread_evenly():
    spread = {'latency': 0.01, 'latency_spread': 0.02, 'stamps': 'arrival'}
    late_ns = [sample.stamp_ns - sample.left_pulses * PERIOD_NS for _, sample in arrivals(**spread)]
    assert np.min(late_ns) >= 10 * MS and np.max(late_ns) <= 30 * MS
    assert np.mean(late_ns) == pytest.approx(20 * MS, rel=0.02)
    assert np.std(late_ns) == pytest.approx(20 * MS / 12**0.5, rel=0.05)


def test_fractions_are_lost_come_twice_or_after_the_next():
    assert len(arrivals(lost=0.2)) == pytest.approx(1600, rel=0.05)
    assert len(arrivals(repeated=0.2)) == pytest.approx(2400, rel=0.05)
    order = [sample.left_pulses for _, sample in arrivals(reordered=0.2)]
    overtaken = sum(later < earlier for earlier, later in zip(order, order[1:]))
    assert len(order) == pytest.approx(2000, abs=2) and 250 < overtaken < 400


@pytest.mark.parametrize(
    'keys',
    [
        {'latency': 0.03, 'latency_spread': 0.04},
        {'reordered': 0.5},
        {'lost': 0.1, 'reordered': 0.1, 'repeated': 0.1, 'latency_spread': 0.1, 'stamps': 'arrival'},
    ],
)
def test_after_the_longest_delay_a_report_or_a_later_one_has_come(keys):
    delay_ns = ReportParams.from_mapping(keys, 'report').longest_delay_s(PERIOD_NS * 1e-9) * 1e9
    newest_ns = 0
    for now_ns, sample in arrivals(**keys):
        assert newest_ns >= (now_ns - 10 * MS - delay_ns) // PERIOD_NS * PERIOD_NS - 1  # up to the tick before
        newest_ns = max(newest_ns, sample.stamp_ns)


@pytest.mark.parametrize('keys', [{'reordered': 0.5}, {'latency_spread': 0.3, 'repeated': 0.5, 'reordered': 0.5}])
def test_no_report_is_farther_behind_the_newest_than_its_parameters_allow(keys):
    """Up to a period: which sample is the newest at the farthest is a matter of whole periods."""
    stamps_ns = [sample.stamp_ns for _, sample in arrivals(5000, **keys)]
    allowed_ns = sum(ReportParams(**keys).most_behind_s(PERIOD_NS * 1e-9).values()) * 1e9
    assert allowed_ns - 2 * PERIOD_NS < np.max(np.maximum.accumulate(stamps_ns) - stamps_ns) <= allowed_ns


def counts(index):
    return EncoderSample(index * PERIOD_NS, index, -index)


def whole(index):
    return counts(index)._replace(wheel_rates_radps=(float(index), -float(index)))


def take(pairing, words):
    """What is released, by words such as c3 or s3: counts or speeds of report 3."""
    released = []
    for word in words.split():
        report = whole(int(word[1:]))
        if word[0] == 'c':
            released += pairing.take_counts(report._replace(wheel_rates_radps=None), report.stamp_ns * 1e-9)
        else:
            released += pairing.take_speeds(report.stamp_ns, report.wheel_rates_radps)
    return released


def test_in_any_interleaving_of_the_topics_each_report_is_whole_and_in_order():
    for seed in range(200):
        rng, pairing, released = random.Random(seed), SpeedPairing(), []
        at = {'c': 0, 's': 0}
        while min(at.values()) < 40:
            ahead = at['c'] - at['s']
            kind = 's' if ahead >= 9 else 'c' if ahead <= -9 else rng.choice('cs')
            released += take(pairing, f'{kind}{at[kind]}')
            at[kind] += 1
        assert released == [whole(index) for index in range(40)][: len(released)] and len(released) >= 40


@pytest.mark.parametrize(
    ('words', 'expected'),
    [
        ('c0 s0 c1 c2 s2 c3 s3', [whole(0), counts(1), whole(2), whole(3)]),  # speeds of 1 are lost
        ('s0 c0 s1 s2 c2 s3 c3', [whole(0), whole(2), whole(3)]),  # counts of 1 are lost
        ('c0 s0 c1 s1 c0 s0 c2 s2', [whole(0), whole(1), whole(0), whole(2)]),  # 0 comes twice
        ('s0 c0 s2 c2 s1 c1 s3 c3', [whole(0), whole(2), whole(1), whole(3)]),  # 1 comes after 2
        *(
            (f's100 c100{rest} {again}', [whole(100), *left, whole(0), whole(1)])  # time jumps back
            for rest, left in (('', []), (' s103', []), (' c103', []))
            for again in ('c0 s0 c1 s1', 's0 c0 s1 c1')
        ),
    ],
)
def test_lost_repeated_and_late_reports_keep_their_speeds(words, expected):
    found = take(SpeedPairing(), words)
    assert found[:1] + found[-len(expected) + 1 :] == expected


def test_if_speeds_never_come_reports_wait_once(caplog):
    """Half a second, which at 20 Hz are ten reports."""
    pairing = SpeedPairing()
    assert take(pairing, ' '.join(f'c{index}' for index in range(11))) == []
    assert take(pairing, 'c11') == [counts(index) for index in range(12)]
    assert take(pairing, 'c12 c13') == [counts(12), counts(13)]
    assert [record.levelname for record in caplog.records] == ['WARNING']
    assert take(pairing, 's13 c14 s14 c15 s15') == [whole(14), whole(15)]
