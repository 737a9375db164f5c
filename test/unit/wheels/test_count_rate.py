"""Counts and reports in a second."""

import pytest

from diff_encoder_sim.wheels.diagnostics import CountRate
from diff_encoder_sim.wheels.encoder_params import wrap_count

MS = 1_000_000


def rate_after(reports, modulus=0):
    rate = CountRate(modulus)
    for stamp_ms, left, right in reports:
        rate.take(stamp_ms * MS, wrap_count(left, modulus), wrap_count(right, modulus))
    return (*rate.counts_per_s, rate.reports_per_s)


@pytest.mark.parametrize('modulus', [0, 256])
def test_counts_and_reports_of_the_last_second_that_is_over(modulus):
    """Across wraps, whatever the counters showed at the start."""
    assert rate_after([(50 * index, 200 + 3 * index, -5 * index) for index in range(45)], modulus) == (
        60.0,
        -100.0,
        20.0,
    )


def test_before_the_first_second_is_over_there_is_none():
    assert rate_after([(50 * index, index, index) for index in range(20)]) == (0.0, 0.0, 0.0)


def test_the_second_is_as_long_as_the_stamps_say():
    assert rate_after([(0, 0, 0), (4000, 400, 800)]) == (100.0, 200.0, 0.25)


def test_time_that_goes_back_begins_a_new_second():
    assert rate_after([(5000, 0, 0), (100, 900, 900), (1100, 910, 920)]) == (10.0, 20.0, 1.0)
