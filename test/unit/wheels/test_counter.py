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
    Counters,
    count_difference,
    next_counters,
    wrap_count,
)


@given(st.integers(2, 10**6), st.integers(-(10**9), 10**9), st.data())
def test_differences_survive_the_wrap_in_both_directions(modulus, start, data):
    moved = data.draw(st.integers(-(modulus // 2), (modulus - 1) // 2))
    older, newer = wrap_count(start, modulus), wrap_count(start + moved, modulus)
    assert count_difference(newer, older, modulus) == moved
    assert count_difference(newer % modulus, older % modulus, modulus) == moved
    assert wrap_count(start, 65536) == np.array(start).astype(np.int16)


# Of equal intervals of 1 s: pulses by which the greatest acceleration changes one.
MOST, SECOND_NS = 3.0, 10**9
LIMITS = CounterLimits(0, 1e9, 1e9, 1e-9, 1e-9, MOST, MOST)


def counted(before, now, went, **limits):
    """Pulses and cause between two readings, after `went` pulses in the second before."""
    first = (-SECOND_NS, -went[0], -went[1]) if went else (0, 0, 0)
    counters = Counters(before, (0, 0, 0), (0, 0, 0), first)
    after, cause = next_counters(LIMITS._replace(**limits), counters, SECOND_NS, *now)
    return (*after.total[1:], cause)


@pytest.mark.parametrize(
    ('limits', 'before', 'now', 'went', 'expected'),
    [
        ({}, (1000, -400), (1, 0), (0, 0), (1, 0, NEAR_ZERO)),
        ({'modulus': 256}, (127, 127), (-128, -128), (1, 1), (1, 1, WENT_ON)),  # +127 of 8 bits is followed by -128
        ({}, (30, 28), (30, 28), (40, 40), (0, 0, WENT_ON)),  # a robot against a wall near where its counters began
        ({'left_speed': 30.0}, (1000, 0), (2000, 0), None, (0, 0, TOO_FAST)),
    ],
)
def test_counters_that_jump_to_zero_or_turn_too_fast_were_restarted(limits, before, now, went, expected):
    assert counted(before, now, went, **limits) == expected


@pytest.mark.parametrize('distance', [1, 2, 4, 5, 6, 50])
def test_it_is_seen_from_where_the_greatest_acceleration_no_longer_explains_it(distance):
    _, _, cause = counted((distance, distance), (0, 0), (0, 0))
    assert (cause == NEAR_ZERO) == (distance > MOST + ROUNDING_PULSES)
