"""Reports that have not come, by the stamps of those that have."""

import numpy as np
import pytest

from diff_encoder_sim.wheels.diagnostics import LostReports

PERIOD_NS = 50_000_000


def count_of(stamps_ns, rate_hz=20.0):
    lost = LostReports(rate_hz)
    for stamp_ns in stamps_ns:
        lost.take(int(stamp_ns))
    return lost.count


@pytest.mark.parametrize('probability', [0.0, 0.01, 0.2, 0.8])
def test_each_gap_counts_as_many_as_are_missing(probability):
    rng = np.random.default_rng(1)
    came = np.flatnonzero(rng.random(2000) >= probability)
    assert count_of(came * PERIOD_NS) == came[-1] - came[0] + 1 - len(came)


@pytest.mark.parametrize('jitter', [0.1, 0.4])
def test_jitter_is_no_loss(jitter):
    rng = np.random.default_rng(1)
    assert count_of((np.arange(5000) + rng.uniform(0.0, jitter, 5000)) * PERIOD_NS) == 0


@pytest.mark.parametrize('skew', [-3e-3, 1e-3, 3e-3])
def test_a_clock_that_is_slow_or_fast_is_no_loss(skew):
    assert count_of(np.arange(20_000) * PERIOD_NS * (1.0 + skew)) == 0
