"""Wheels that come at times of their own, at the same instants."""

import numpy as np
import pytest

from diff_encoder_sim.drives.field_wheels import LEFT, RIGHT, PairedAngles

SECOND_NS = 10**9


def fed(samples):
    """All pairs of (side, stamp [s], angle) in this order, and the pairing."""
    pairs = PairedAngles()
    found = [pair for side, stamp_s, angle in samples for pair in pairs.add(side, round(stamp_s * SECOND_NS), angle)]
    return [(stamp_ns / SECOND_NS, left, right) for stamp_ns, left, right in found], pairs


def at_rate(side, speed, rate_hz, late_s=0.0, duration_s=10.0):
    times_s = np.arange(late_s, duration_s, 1.0 / rate_hz)
    return [(side, time_s, speed * time_s) for time_s in times_s.tolist()]


@pytest.mark.parametrize(('rate_hz', 'late_s'), [(10.0, 0.05), (10.0, 0.0), (100.0, 0.003), (7.0, 0.02), (33.0, 0.0)])
def test_a_wheel_that_turns_evenly_is_interpolated_exactly(rate_hz, late_s):
    samples = sorted(at_rate(LEFT, 2.0, 10.0) + at_rate(RIGHT, 3.0, rate_hz, late_s), key=lambda sample: sample[1])
    found, pairs = fed(samples)
    assert pairs.left_out == 0 and len(found) >= 98
    for stamp_s, left, right in found:
        assert (left, right) == pytest.approx((2.0 * stamp_s, 3.0 * stamp_s), abs=1e-6)


def test_equal_stamps_need_no_interpolation():
    found, _ = fed([(LEFT, 1.0, 5.0), (RIGHT, 1.0, 7.0), (RIGHT, 1.1, 8.0), (LEFT, 1.1, 6.0)])
    assert found == [(1.0, 5.0, 7.0), (1.1, 6.0, 8.0)]


def test_nothing_is_made_up_across_a_gap():
    right = [sample for sample in at_rate(RIGHT, 3.0, 10.0) if not 2.0 < sample[1] < 6.0]
    found, pairs = fed(sorted(at_rate(LEFT, 2.0, 10.0, 0.05) + right, key=lambda sample: sample[1]))
    assert not [stamp_s for stamp_s, _, _ in found if 2.0 < stamp_s < 6.0]
    assert pairs.left_out == 40 and found[-1][0] > 9.8


def test_what_is_repeated_or_overtaken_is_ignored():
    found, _ = fed([(RIGHT, 1.0, 7.0), (RIGHT, 2.0, 8.0), (LEFT, 1.5, 1.0), (LEFT, 1.5, 9.0), (LEFT, 1.2, 9.0)])
    assert found == [(1.5, 1.0, 7.5)]


def test_time_that_is_set_back_starts_again():
    once = [(RIGHT, 10.0, 1.0), (LEFT, 10.0, 2.0), (RIGHT, 10.5, 1.5), (LEFT, 10.5, 3.0)]
    found, _ = fed(once + [(side, stamp_s - 8.0, angle) for side, stamp_s, angle in once])
    assert [stamp_s for stamp_s, _, _ in found] == [10.0, 10.5, 2.0, 2.5]


def test_a_second_is_kept_at_most():
    pairs = PairedAngles()
    for tick in range(5000):
        pairs.add(LEFT, tick * SECOND_NS // 100, 0.0)
    assert len(pairs._sides[LEFT]) <= 101
