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
    near_zero = _are_within(counts, (abs(pulses_before[0]), abs(pulses_before[1])), most_change)
    if not near_zero or not any(pulses) or _are_within(counts_before, (0.0, 0.0), most_change):
        return False
    changes = pulses[0] - pulses_before[0], pulses[1] - pulses_before[1]
    return not _are_within(changes, (0.0, 0.0), most_change)


def _are_within(pulses: Tuple[float, float], most: Tuple[float, float], margin: Tuple[float, float]) -> bool:
    """Return whether the pulses of neither wheel are more than its most, by more than a margin and the rounding."""
    return (
        abs(pulses[0]) <= most[0] + margin[0] + ROUNDING_PULSES
        and abs(pulses[1]) <= most[1] + margin[1] + ROUNDING_PULSES
    )
