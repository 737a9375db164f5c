"""Search for the lowest sufficient encoder, with the same number of trials per tested encoder.

A candidate suffices if a one-sided binomial test of each test's trials shows more than the required fraction.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Callable, Dict, Mapping, NamedTuple, Optional, Sequence

import numpy as np

from diff_encoder_sim.advice.answers import Answer, Criterion, Kind, Requirement
from diff_encoder_sim.analysis.statistics import Interval
from diff_encoder_sim.analysis.summaries import Sufficiency
from diff_encoder_sim.base.deferred import deferred

if TYPE_CHECKING:
    from diff_encoder_sim.advice.odometry_study import Candidate

special = deferred('scipy.special')

MOST_PREDICTED = 1000  # more trials are not predicted
FORGIVEN = 2  # failures with which the default number of trials still shows the fraction


class TrialCounts(NamedTuple):
    """Trials of one test with one encoder."""

    within: int  # the tolerance
    trials: int

    def interval(self, confidence: float) -> Interval:
        """Return Clopper and Pearson's bounds of the true fraction; each of them holds with `confidence`."""
        within, outside, doubt = self.within, self.trials - self.within, 1.0 - confidence
        low = special.betaincinv(within, outside + 1, doubt) if within else 0.0
        high = special.betaincinv(within + 1, outside, 1.0 - doubt) if outside else 1.0
        return Interval(float(low), float(high))


def fewest_trials(requirement: Requirement, failures: int = 0) -> int:
    """Return the smallest number of trials that shows the required fraction although `failures` of them fail."""
    trials = np.arange(failures + 1, 100_000)
    return int(trials[np.argmax(_p_enough(trials - failures, trials, requirement.share) <= requirement.doubt)])


def judged(tests: Sequence[Sequence[float]], share: float, doubt: float) -> Sufficiency:
    """Return whether the fraction is shown to be more than `share` in each test, or less in at least one.

    `tests` are the trials within the tolerance, and all trials, of each; they share the doubt of a refusal.
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
    return np.asarray(special.betainc(np.maximum(within, 1e-9), trials - within + 1, share))


def search(
    candidates: Sequence[Candidate],
    run: Callable[[int], Mapping[Criterion, Sequence[TrialCounts]]],
    guesses: Mapping[Criterion, int],
    requirement: Requirement,
) -> Dict[Criterion, Answer]:
    """Find the lowest sufficient candidate for each criterion: the highest, the guess, its neighbour, then bisection.

    Candidates are in ascending quality: a higher one is assumed not to be worse. `run` runs the trials of each test
    with a candidate, by its index, once for all criteria; `guesses` are the indices that probably suffice.
    """
    counts: Dict[int, Mapping[Criterion, Sequence[TrialCounts]]] = {}
    top = len(candidates) - 1

    def verdict(index: int, criterion: Criterion) -> Sufficiency:
        if index not in counts:
            counts[index] = run(index)
        return judged(counts[index][criterion], requirement.share, requirement.doubt)

    def more(index: int, criterion: Criterion) -> Optional[int]:
        return more_trials(counts[index][criterion], requirement.share, requirement.doubt)

    def answer(criterion: Criterion, guess: int) -> Answer:
        of_top = verdict(top, criterion)
        if of_top is Sufficiency.NO:
            return Answer(criterion, Kind.NOT_THE_LIMIT)
        if of_top is Sufficiency.UNDECIDED:
            return Answer(criterion, Kind.UNDECIDED, more_trials=more(top, criterion))
        low, high = -1, top
        while high - low > 1:
            probes = (index for index in (guess, guess - 1, guess + 1) if low < index < high)
            index = next(probes, (low + high) // 2)
            low, high = (low, index) if verdict(index, criterion) is Sufficiency.YES else (index, high)
        refused = [each for each in counts if each < high and verdict(each, criterion) is Sufficiency.NO]
        enough = candidates[high]
        too_few = candidates[max(refused)].counts if refused else None
        found = Answer(criterion, Kind.FROM, enough.counts, (too_few, enough.counts), enough.label)
        if low < 0 or low in refused:
            return found
        return found._replace(undecided=candidates[low].label, more_trials=more(low, criterion))

    return {criterion: answer(criterion, guess) for criterion, guess in guesses.items()}
