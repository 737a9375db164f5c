"""What became slower from one run of the ratio benchmarks to another, beyond its spread, and what only one has."""

from __future__ import annotations

from typing import List, NamedTuple, Sequence, Tuple

from ratios import Ratio

# Medians that differ by less are equal, however near each other the rounds are.
LEAST_CHANGE = 0.1


class Change(NamedTuple):
    """One ratio in both runs."""

    name: str
    before: float  # medians
    now: float
    is_slower: bool
    limit: str = ''  # what it is to stay below now, and whether it does not


def changes(before: Sequence[Ratio], now: Sequence[Ratio]) -> List[Change]:
    """Compare what both runs have, by name: slower where every round is above all from before, and by enough."""
    old = {(ratio.name, ratio.of): ratio for ratio in before}
    pairs = [(old[ratio.name, ratio.of], ratio) for ratio in now if (ratio.name, ratio.of) in old]
    return [Change(new.name, first.median, new.median, _is_slower(first, new), new.limit) for first, new in pairs]


def one_sided(before: Sequence[Ratio], now: Sequence[Ratio]) -> Tuple[List[str], List[str]]:
    """Return the names of what only the run before has, and of what only this one has."""
    return _without(before, now), _without(now, before)


def _without(ratios: Sequence[Ratio], others: Sequence[Ratio]) -> List[str]:
    found = {(other.name, other.of) for other in others}
    return [f'{ratio.name}, in units of {ratio.of}' for ratio in ratios if (ratio.name, ratio.of) not in found]


def _is_slower(before: Ratio, now: Ratio) -> bool:
    return min(now.rounds) > max(before.rounds) and now.median > (1.0 + LEAST_CHANGE) * before.median
