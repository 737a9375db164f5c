"""The conclusions of hypothesis tests: a part of a claim holds, fails, or is unclear.

A claim has many parts (tests, encoders, quantities) and holds when all of them do, for which 95 %
in each are enough. It fails when one of them does; that this is not chance is kept at 95 % for all
parts together, by Holm.
"""

from __future__ import annotations

import enum
from typing import Iterable, List, NamedTuple, Optional

from diff_encoder_sim.analysis.paired_statistics import SIGNIFICANCE, holm


class Conclusion(enum.Enum):
    """What a hypothesis test shows."""

    HOLDS = 'holds'
    FAILS = 'fails'
    UNCLEAR = 'unclear'


class PartResult(NamedTuple):
    """A part of a claim, tested for itself."""

    text: str  # with the numbers
    holds: bool  # with 95 % confidence
    p_against: float  # of the part being true; 1 where our trials are on the claim's side


class HypothesisTest(NamedTuple):
    """The test of one part of a claim."""

    conclusion: Conclusion
    text: str  # with the numbers
    p_against: Optional[float] = None  # corrected for the number of parts; None without enough trials


def concluded(parts: Iterable[PartResult]) -> List[HypothesisTest]:
    """Conclude from all parts of a claim, which are corrected for their number."""
    parts = list(parts)
    return [
        HypothesisTest(_conclusion(part, p_value), part.text, p_value)
        for part, p_value in zip(parts, holm([part.p_against for part in parts]))
    ]


def too_few(label: str) -> HypothesisTest:
    """Return the test of a part without enough trials."""
    return HypothesisTest(Conclusion.UNCLEAR, f'{label}: too few trials')


def _conclusion(part: PartResult, p_against: float) -> Conclusion:
    if p_against < SIGNIFICANCE:
        return Conclusion.FAILS
    return Conclusion.HOLDS if part.holds else Conclusion.UNCLEAR
