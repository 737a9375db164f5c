"""Counters of finite width: wraps, differences, and restarts."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from diff_encoder_sim.wheels.counter import (
    NEAR_ZERO,
    ROUNDING_PULSES,
    TOO_FAST,
    WENT_ON,
    CounterLimits,
    CounterSteps,
    Reading,
    count_difference,
    counted_between,
    totals_of,
    wrap_count,
)


@pytest.mark.parametrize(
    ('pulses', 'shown'), [(32767, 32767), (32768, -32768), (-32768, -32768), (-32769, 32767), (65536, 0)]
)
def test_an_int16_counter_wraps_as_int16_does(pulses, shown):
    assert wrap_count(pulses, 65536) == shown


@given(st.integers(2, 10**6), st.integers(-(10**9), 10**9), st.data())
def test_differences_survive_the_wrap_in_both_directions(modulus, start, data):
    moved = data.draw(st.integers(-(modulus // 2), (modulus - 1) // 2))
    older, newer = wrap_count(start, modulus), wrap_count(start + moved, modulus)
    assert count_difference(newer, older, modulus) == moved
    assert count_difference(newer % modulus, older % modulus, modulus) == moved


# Of equal intervals of 1 s: pulses by which the greatest acceleration changes one.
MOST, SECOND_NS = 3.0, 10**9
LIMITS = CounterLimits(0, 1.0, 1.0, MOST, MOST, 1e9, 1e-9)


def cause(before, now, went=(0, 0), limits=LIMITS):
    return counted_between(limits, before, now, SECOND_NS, SECOND_NS, went)[2]


def test_counters_that_jump_to_zero_were_restarted():
    assert counted_between(LIMITS, (1000, -400), (1, 0), SECOND_NS, SECOND_NS, (0, 0)) == (1, 0, NEAR_ZERO)


def test_a_wrap_at_the_end_of_the_range_is_none():
    """+127 of 8 bits is followed by -128, one pulse further."""
    assert cause((127, 127), (-128, -128), (1, 1), LIMITS._replace(modulus=256)) == WENT_ON


@pytest.mark.parametrize('distance', [1, 2, 4, 5, 6, 50])
def test_it_is_seen_from_where_the_greatest_acceleration_no_longer_explains_it(distance):
    assert (cause((distance, distance), (0, 0)) == NEAR_ZERO) == (distance > MOST + ROUNDING_PULSES)


def test_counters_that_stand_still_were_not_restarted():
    """As of a robot that runs against a wall near where its counters began."""
    assert cause((30, 28), (30, 28), (40, 40)) == WENT_ON


def test_a_step_faster_than_the_wheels_is_lost():
    limits = LIMITS._replace(max_speed_radps=200.0)
    assert counted_between(limits, (1000, 0), (2000, 0), SECOND_NS, 0, (0, 0)) == (0, 0, TOO_FAST)


@given(st.lists(st.tuples(st.integers(-30, 30), st.integers(-30, 30), st.integers(-1, 3)), min_size=1, max_size=60))
def test_totals_of_many_reports_are_those_of_one_after_the_other(steps):
    """With stale reports, restarts at zero and counters of 8 bits."""
    limits = LIMITS._replace(modulus=256, max_speed_radps=150.0)
    stamps_ns = np.cumsum([7 * 10**6 * step for _, _, step in steps])
    counts = wrap_count(np.cumsum([step[:2] for step in steps], axis=0), 256)
    counts[len(steps) // 2 :] -= counts[len(steps) // 2]
    one_by_one, total, totals, newest_ns = CounterSteps(limits), np.zeros(2), [], None
    for stamp_ns, both in zip(stamps_ns.tolist(), counts.tolist()):
        if newest_ns is None or stamp_ns > newest_ns:
            newest_ns, step = stamp_ns, one_by_one.take(Reading(stamp_ns, *both))
            total = total + (step[:2] if step else (0, 0))
        totals.append(total)
    np.testing.assert_array_equal(totals_of(limits, stamps_ns[np.newaxis], counts[np.newaxis])[0], totals)
