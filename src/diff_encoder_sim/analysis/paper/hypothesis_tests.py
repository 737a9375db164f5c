"""The conclusions of hypothesis tests: a part of a claim holds, fails, or is unclear.

A claim has many parts (tests, encoders, quantities) and holds when all of them do, for which 95 %
in each are enough. It fails when one of them does; that this is not chance is kept at 95 % for all
parts together, by Holm for p-values and by Bonferroni for intervals.
"""

from __future__ import annotations

import enum
from typing import NamedTuple


class Conclusion(enum.Enum):
    """What a hypothesis test shows."""

    HOLDS = 'holds'
    FAILS = 'fails'
    UNCLEAR = 'unclear'


class HypothesisTest(NamedTuple):
    """The test of one part of a claim."""

    conclusion: Conclusion
    text: str  # with the numbers


def too_few(label: str) -> HypothesisTest:
    """Return the test of a part without enough trials."""
    return HypothesisTest(Conclusion.UNCLEAR, f'{label}: too few trials')


def holds_if(condition: bool, text: str) -> HypothesisTest:
    """Return the test of a statement about these very trials, which chance plays no part in."""
    return HypothesisTest(Conclusion.HOLDS if condition else Conclusion.FAILS, text)
