"""Recognising that counters began anew at zero, as when a motor controller restarts in mid-drive."""

from __future__ import annotations

from typing import Tuple

# Whole pulses make a speed uncertain by one at either end of an interval, and of the one before.
ROUNDING_PULSES = 2.0


def is_restart(
    counts_before: Tuple[int, int],
    counts: Tuple[int, int],
    pulses: Tuple[int, int],
    pulses_before: Tuple[float, float],
    most_change: Tuple[float, float],
) -> bool:
    """Return whether both counters are as near zero as the wheels can have turned, and going on needs too much of one.

    One controller has both, so a jump of one counter alone is none. Where both were near zero before, a restart loses
    no more than a jerk that is taken for one.

    Args:
        counts_before: left and right counter at the last report, signed.
        counts: left and right counter now, signed.
        pulses: since the last report, if they went on.
        pulses_before: what the speed before makes of the same interval.
        most_change: by how much the greatest acceleration, and errors of the encoder, change that, in pulses.
    """
    went_on = all(
        abs(now - before) <= most + ROUNDING_PULSES for now, before, most in zip(pulses, pulses_before, most_change)
    )
    near_zero = all(
        abs(count) <= abs(before) + most + ROUNDING_PULSES
        for count, before, most in zip(counts, pulses_before, most_change)
    )
    were_far = any(abs(count) > most + ROUNDING_PULSES for count, most in zip(counts_before, most_change))
    return any(pulses) and were_far and near_zero and not went_on
