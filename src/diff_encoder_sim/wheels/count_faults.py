"""Counts that are missed, too many, or too fast."""

from __future__ import annotations

from typing import Optional

import numpy as np

from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.wheels.encoder_params import FaultParams

# More in one call are no motion but a jump of the angle: their number alone is drawn.
MOST_ONE_BY_ONE = 100_000


class HitCounts:
    """Chooses some of the counts, one by one or in bursts, however they are split into calls."""

    def __init__(self, fraction: float, burst: float, rng: np.random.Generator) -> None:
        """Prepare.

        Args:
            fraction: of the counts that are chosen, above 0.
            burst: how many in a row, on average.
            rng: draws the distances between bursts and their lengths, both geometric.
        """
        self._mean_gap = burst * (1.0 - fraction) / fraction
        self._fraction, self._burst, self._rng = fraction, burst, rng
        self._in_gap, self._in_burst = self._draw_gap(), 0

    def take(self, counts: int) -> int:
        """Return how many of the next `counts` are chosen."""
        if counts * self._fraction > MOST_ONE_BY_ONE:
            return int(self._rng.binomial(counts, self._fraction))
        chosen = 0
        while counts > 0:
            if self._in_burst == 0 and self._in_gap >= counts:
                self._in_gap -= counts
                break
            if self._in_burst == 0:
                counts -= self._in_gap
                self._in_gap, self._in_burst = 0, int(self._rng.geometric(1.0 / self._burst))
            within = min(counts, self._in_burst)
            chosen, counts, self._in_burst = chosen + within, counts - within, self._in_burst - within
            if self._in_burst == 0:
                self._in_gap = self._draw_gap()
        return chosen

    def _draw_gap(self) -> int:
        # Beyond 2^62 counts, which no drive has, the draw would overflow.
        return int(self._rng.geometric(1.0 / min(self._mean_gap + 1.0, 2.0**62))) - 1


class CountFaults:
    """Changes the counts on their way from decoder to counter."""

    def __init__(self, params: FaultParams, rng: np.random.Generator) -> None:
        """Prepare for one wheel."""
        self._missed = _hits(params.missed, params.missed_burst, rng)
        self._extra = _hits(params.extra, params.extra_burst, rng)
        self._most_per_ns = params.max_count_rate / NANOSECONDS_PER_SECOND
        self._unused = 0.0  # of the count that the rate allowed and did not get
        self._until_ns = 0

    def counted(self, counts: int, from_ns: int, to_ns: int) -> int:
        """Return what the counter gets of the signed counts of an interval; between intervals nothing was counted."""
        number = abs(counts)
        if self._missed is not None:
            number -= self._missed.take(number)
        if self._extra is not None:
            number += self._extra.take(abs(counts))
        if self._most_per_ns:
            idle_ns = from_ns - self._until_ns
            allowed = min(self._unused + idle_ns * self._most_per_ns, 1.0) + (to_ns - from_ns) * self._most_per_ns
            number = min(number, int(allowed))
            self._unused, self._until_ns = min(allowed - number, 1.0), to_ns
        return number if counts >= 0 else -number


def _hits(fraction: float, burst: float, rng: np.random.Generator) -> Optional[HitCounts]:
    return HitCounts(fraction, burst, rng) if fraction else None
