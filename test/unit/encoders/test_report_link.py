"""The way of reports to the host."""

import numpy as np
import pytest

from diff_encoder_sim.encoders.encoder_sample import EncoderSample
from diff_encoder_sim.encoders.report_link import ReportLink, ReportParams

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


def test_promptly_each_sample_comes_at_once():
    assert arrivals(20) == [(index * PERIOD_NS, EncoderSample(index * PERIOD_NS, index, -index)) for index in range(20)]


def test_a_late_sample_has_its_own_time_or_that_of_its_arrival():
    for stamps, late_ms in (('sample', 0), ('arrival', 25)):
        for now_ns, sample in arrivals(20, latency=0.025, stamps=stamps):
            assert now_ns == sample.left_pulses * PERIOD_NS + 30 * MS  # at the next tick
            assert sample.stamp_ns == sample.left_pulses * PERIOD_NS + late_ms * MS


def test_the_latency_is_spread_evenly():
    late_ns = [
        sample.stamp_ns - sample.left_pulses * PERIOD_NS
        for _, sample in arrivals(latency=0.01, latency_spread=0.02, stamps='arrival')
    ]
    assert np.min(late_ns) >= 10 * MS and np.max(late_ns) <= 30 * MS
    assert np.mean(late_ns) == pytest.approx(20 * MS, rel=0.02) and np.std(late_ns) == pytest.approx(
        20 * MS / 12**0.5, rel=0.05
    )


def test_fractions_are_lost_come_twice_or_after_the_next():
    assert len(arrivals(lost=0.2)) == pytest.approx(1600, rel=0.05)
    assert len(arrivals(repeated=0.2)) == pytest.approx(2400, rel=0.05)
    order = [sample.left_pulses for _, sample in arrivals(reordered=0.2)]
    overtaken = sum(later < earlier for earlier, later in zip(order, order[1:]))
    assert len(order) == pytest.approx(2000, abs=2) and 250 < overtaken < 400
