"""The way of reports to the host."""

import numpy as np
import pytest

from diff_encoder_sim.wheels.report_link import EncoderSample, ReportLink, ReportParams

MS = 1_000_000
PERIOD_NS = 50 * MS


def arrivals(count=2000, tick_ms=10, seed=1, **keys):
    """When each sample arrived [ns], and the samples, one sent each period."""
    link = ReportLink(ReportParams.from_mapping(keys, 'report'), PERIOD_NS * 1e-9, np.random.default_rng(seed))
    found = []
    for now_ns in range(0, count * PERIOD_NS, tick_ms * MS):
        index, rest = divmod(now_ns, PERIOD_NS)
        sent = EncoderSample(now_ns, index, -index) if rest == 0 else None
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
