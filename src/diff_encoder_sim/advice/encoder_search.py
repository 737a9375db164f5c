"""Search for the lowest sufficient encoder, with the same number of trials per tested encoder.

Encoders have ranks from 0, of ascending quality; a higher rank is assumed not to be worse. An encoder
suffices if a one-sided binomial test of each test's trials shows more than the required fraction.
"""

from __future__ import annotations

from typing import Callable, Dict, List, Mapping, NamedTuple, Optional, Sequence, TypeVar

import numpy as np

from diff_encoder_sim.analysis.quantities import LEVEL, REQUIRED_FRACTION
from diff_encoder_sim.analysis.statistics import Interval
from diff_encoder_sim.analysis.within_tolerance import Sufficiency
from diff_encoder_sim.base.deferred import deferred

special = deferred('scipy.special')

# A search judges about this number of insufficient encoders, which share the chance of error (Bonferroni).
VERDICTS = 5

# More trials than this are not predicted.
MOST_PREDICTED = 1000

# Default number of trials: enough to show the fraction if this number of trials fails.
FORGIVEN = 2


class TrialCounts(NamedTuple):
    """Trials of one test with one encoder."""

    within: int  # the tolerance
    trials: int

    @property
    def fraction(self) -> float:
        """Return the fraction within the tolerance; requires at least one trial."""
        return self.within / self.trials


class Asked(NamedTuple):
    """The required fraction of each test's trials, and the confidence of an answer."""

    share: float = REQUIRED_FRACTION
    confidence: float = LEVEL

    @property
    def doubt(self) -> float:
        """Return the chance of error of one verdict."""
        return (1.0 - self.confidence) / VERDICTS

    def fewest_trials(self, failures: int = 0) -> int:
        """Return the smallest number of trials that shows the fraction although `failures` of them fail."""
        trials = np.arange(failures + 1, 100_000)
        return int(trials[np.argmax(_p_enough(trials - failures, trials, self.share) <= self.doubt)])


def fraction_interval(counts: TrialCounts, confidence: float) -> Interval:
    """Return Clopper and Pearson's bounds of the true fraction; each of them holds with `confidence`."""
    within, outside, doubt = counts.within, counts.trials - counts.within, 1.0 - confidence
    low = special.betaincinv(within, outside + 1, doubt) if within else 0.0
    high = special.betaincinv(within + 1, outside, 1.0 - doubt) if outside else 1.0
    return Interval(float(low), float(high))


def judged(tests: Sequence[Sequence[float]], share: float, doubt: float) -> Sufficiency:
    """Return whether the fraction is shown to be more than `share` in each test, or less in at least one.

    Args:
        tests: trials within the tolerance, and all trials, of each test; tests share the doubt of a refusal.
        share: required fraction.
        doubt: chance of error.
    """
    within, trials = np.array(tests, dtype=float).T
    if (_p_enough(within, trials, share) <= doubt).all():
        return Sufficiency.YES
    is_too_few = _p_enough(trials - within, trials, 1.0 - share) <= doubt / len(tests)
    return Sufficiency.NO if is_too_few.any() else Sufficiency.UNDECIDED


def more_trials(tests: Sequence[TrialCounts], share: float, doubt: float) -> Optional[int]:
    """Return the number of further trials of each test that would decide; None if more than MOST_PREDICTED.

    Assumes the current fraction, shrunk by half a trial towards 1/2: 20 of 20 may not continue.
    """
    for more in range(MOST_PREDICTED + 1):
        grown = [(within + more * (within + 0.5) / (trials + 1.0), trials + more) for within, trials in tests]
        if judged(grown, share, doubt) is not Sufficiency.UNDECIDED:
            return more
    return None


def _p_enough(within: np.ndarray, trials: np.ndarray, share: float) -> np.ndarray:
    """Return the chance of at least `within` of `trials` if the true fraction is `share`; counts may be fractional."""
    p_value: np.ndarray = special.betainc(np.maximum(within, 1e-9), trials - within + 1, share)
    return p_value


def monotone_fractions(ranks: Sequence[TrialCounts]) -> List[float]:
    """Fit fractions that do not fall from rank to rank: the largest of all smallest means from a rank to its right.

    Args:
        ranks: in ascending quality, each with trials.
    """
    within, trials = np.cumsum([(0, 0), *ranks], axis=0).T
    count = trials - trials[:, np.newaxis]  # from each rank up to each other one
    means = np.where(count > 0, within - within[:, np.newaxis], np.inf) / np.maximum(count, 1)
    smallest = np.minimum.accumulate(means[:-1, :0:-1], axis=1)[:, ::-1]
    fitted: List[float] = np.where(np.tri(len(ranks), dtype=bool).T, smallest, -np.inf).max(axis=0, initial=-1).tolist()
    return fitted


Q = TypeVar('Q')  # questions, such as criteria of a trial

# Runs the trials with the encoder of a rank, and returns the counts of each test by question.
RunRank = Callable[[int], Mapping[Q, Sequence[TrialCounts]]]


class RankAnswer(NamedTuple):
    """The answer to a question.

    YES: an encoder of at least `rank` suffices. NO: not even the highest one does. UNDECIDED: whether that one does.
    """

    kind: Sufficiency
    rank: Optional[int] = None  # the lowest that is shown to suffice
    insufficient: Optional[int] = None  # the highest below it that is shown not to suffice; of NO the highest of all
    undecided: Optional[int] = None  # the rank right below `rank`, or the highest, if its trials do not decide
    more_trials: Optional[int] = None  # of each test at `undecided`, that would probably decide


def search(ranks: int, run: RunRank[Q], guesses: Mapping[Q, int], asked: Asked) -> Dict[Q, RankAnswer]:
    """Find the lowest sufficient rank for each question: the highest rank, the guess, its neighbour, then bisection.

    Args:
        ranks: number of encoders.
        run: called once for a rank; questions share its trials.
        guesses: rank that probably suffices, by question.
        asked: of each encoder.
    """
    counts: Dict[int, Mapping[Q, Sequence[TrialCounts]]] = {}

    def kind(rank: int, question: Q) -> Sufficiency:
        if rank not in counts:
            counts[rank] = run(rank)
        return judged(counts[rank][question], asked.share, asked.doubt)

    def answer(question: Q, guess: int) -> RankAnswer:
        top = kind(ranks - 1, question)
        if top is Sufficiency.NO:
            return RankAnswer(top, insufficient=ranks - 1)
        if top is Sufficiency.UNDECIDED:
            more = more_trials(counts[ranks - 1][question], asked.share, asked.doubt)
            return RankAnswer(top, undecided=ranks - 1, more_trials=more)
        low, high = -1, ranks - 1
        while high - low > 1:
            probes = (rank for rank in (guess, guess - 1, guess + 1) if low < rank < high)
            rank = next(probes, (low + high) // 2)
            low, high = (low, rank) if kind(rank, question) is Sufficiency.YES else (rank, high)
        found = RankAnswer(top, high)
        refused = [each for each in counts if each < high and kind(each, question) is Sufficiency.NO]
        if low >= 0 and low not in refused:
            more = more_trials(counts[low][question], asked.share, asked.doubt)
            found = found._replace(undecided=low, more_trials=more)
        return found._replace(insufficient=max(refused, default=None))

    return {question: answer(question, guess) for question, guess in guesses.items()}
