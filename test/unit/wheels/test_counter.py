"""The counter's finite width, and differences between its readings."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from diff_encoder_sim.wheels.encoder_params import count_difference, wrap_count


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
