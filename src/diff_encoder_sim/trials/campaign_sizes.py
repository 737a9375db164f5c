"""How many trials a campaign may have."""

from __future__ import annotations

from diff_encoder_sim.base.bounded_numbers import Between

# A mistyped list, or one list too many, is refused at once and not after the memory is full.
MOST_CELLS, MOST_TRIALS = 10_000, 1_000_000
TRIALS = Between(1, MOST_TRIALS)  # of each cell
