"""The counter behind an encoder: its finite width, and differences between two readings."""

from __future__ import annotations

from pydantic import Field
from typing_extensions import Annotated

from diff_encoder_sim.base.bounded_numbers import COUNTER_STATES

CounterModulus = Annotated[
    int, COUNTER_STATES, Field(description='counts before the counter wraps: 65536 for int16, 0 for no wrap')
]


def wrap_count(pulses: int, modulus: int) -> int:
    """Return the reading of a two's-complement counter of `modulus` states: [-modulus/2, modulus/2).

    A modulus of 0 stands for a counter that never wraps.
    """
    if modulus == 0:
        return pulses
    half = modulus // 2
    return (pulses + half) % modulus - half


def count_difference(newer: int, older: int, modulus: int) -> int:
    """Return the pulses between two readings of a wrapping counter, in the direction with fewer of them.

    It is right in both directions while fewer than modulus/2 pulses pass between readings, and for
    counters that show [0, modulus) just as for signed ones.
    """
    return wrap_count(newer - older, modulus)
