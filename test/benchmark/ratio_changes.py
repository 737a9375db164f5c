"""What became slower from one run of the ratio benchmarks to another, beyond what their rounds are spread."""

from __future__ import annotations

from typing import List, NamedTuple, Sequence

from ratios import Ratio

# Medians that differ by less are equal, however near each other the rounds are.
LEAST_CHANGE = 0.1


class Change(NamedTuple):
    """One ratio in both runs."""

    name: str
    before: float  # medians
    now: float
    is_slower: bool


def changes(before: Sequence[Ratio], now: Sequence[Ratio]) -> List[Change]:
    """Compare what both runs have, by name: slower where every round is above all from before, and by enough."""
    old = {(ratio.name, ratio.of): ratio for ratio in before}
    pairs = [(old[ratio.name, ratio.of], ratio) for ratio in now if (ratio.name, ratio.of) in old]
    return [Change(new.name, first.median, new.median, _is_slower(first, new)) for first, new in pairs]


def _is_slower(before: Ratio, now: Ratio) -> bool:
    return min(now.rounds) > max(before.rounds) and now.median > (1.0 + LEAST_CHANGE) * before.median
