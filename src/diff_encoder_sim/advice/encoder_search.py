"""Searches the lowest encoder that suffices: by trials of a few, around a first guess of which it is.

Encoders have ranks from 0 on, of ascending quality; one of a higher rank is taken to be no worse. Several questions are
asked of the same trials, those of equal number being paired; each looks only at the ranks that it came to.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Callable, Dict, Generic, List, Mapping, NamedTuple, Optional, Sequence, Tuple, TypeVar

import numpy as np

from diff_encoder_sim.analysis.confidence import LEVEL
from diff_encoder_sim.analysis.quantities import REQUIRED_FRACTION
from diff_encoder_sim.analysis.sample_statistics import Interval
from diff_encoder_sim.analysis.within_tolerance import Sufficiency
from diff_encoder_sim.base.deferred import deferred

optimize = deferred('scipy.optimize')
special = deferred('scipy.special')

JEFFREYS = 0.5  # both parameters of the prior

# A decision that is further off is too far off to say how far.
MOST_FORESEEN = 1000

# Bounds of a share are searched so far from 0, and from the fraction of the trials.
MARGIN = 1e-9


class TrialCounts(NamedTuple):
    """Trials of one test with one encoder."""

    within: int  # the tolerance
    trials: int

    @property
    def fraction(self) -> float:
        """Divide; there must be trials."""
        return self.within / self.trials


def log_evidence_for(within: np.ndarray, trials: np.ndarray, share: float) -> np.ndarray:
    """Compute the logarithm of the e-value against a true share of at most `share`.

    Args:
        within: trials within the tolerance, of any shape; only foreseen ones need not be whole.
        trials: all of them, in the same shape.
        share: required.
    """
    outside = trials - within
    with np.errstate(divide='ignore'):  # no evidence at all: the logarithm of 0
        above = _log_mass_above(share, within + JEFFREYS, outside + JEFFREYS)
    prior = _log_mass_above(share, np.array(JEFFREYS), np.array(JEFFREYS))
    return np.asarray(above - prior - within * np.log(share) - outside * np.log1p(-share))


def log_evidence_against(within: np.ndarray, trials: np.ndarray, share: float) -> np.ndarray:
    """Compute the logarithm of the e-value against a true share of at least `share`; arguments as above."""
    return log_evidence_for(trials - within, trials, 1.0 - share)


def shows_enough(counts: TrialCounts, share: float, doubt: float) -> bool:
    """Return whether the share in a test is shown to be more than `share`, at 1 - `doubt`."""
    return bool(_enough(np.array(counts.within), np.array(counts.trials), share, doubt))


def shows_too_few(tests: Sequence[TrialCounts], share: float, doubt: float) -> bool:
    """Return whether the share in at least one test is shown to be less than `share`, at 1 - `doubt`.

    The mean of the tests' e-values is an e-value itself, whatever they have in common. It is no less than what
    Bonferroni leaves of the largest.
    """
    within, trials = np.array(tests).T
    return bool(_too_few(within, trials, share, doubt))


def more_trials(tests: Sequence[TrialCounts], share: float, doubt: float) -> Optional[int]:
    """Return how many more trials of each test would decide if they went as those so far; None: over MOST_FORESEEN.

    0 where the present ones decide. The fractions so far are taken half a trial nearer to 1/2: 20 of 20 may not go on.
    """
    more = np.arange(MOST_FORESEEN + 1)
    within, trials = np.array(tests, dtype=float).T[:, :, np.newaxis]
    foreseen = within + more * (within + 0.5) / (trials + 1.0), trials + more
    decided = np.all(_enough(*foreseen, share, doubt), axis=0) | _too_few(*foreseen, share, doubt)
    return int(more[np.argmax(decided)]) if decided.any() else None


@lru_cache(maxsize=None)  # asked at each rank of a search
def looks(share: float, doubt: float, most: int) -> Tuple[int, ...]:
    """Return after how many trials to look: each time that one more of them may fail and the share is still shown.

    Args:
        share: required.
        doubt: of each decision.
        most: trials; no look is later. Where even so many show nothing although none fails, there is no look.
    """
    numbers = np.arange(1, most + 1)
    found: List[int] = []
    while True:
        shown = numbers[(numbers >= len(found)) & _enough(numbers - len(found), numbers, share, doubt)]
        if len(shown) == 0:
            return tuple(found)
        found.append(int(shown[0]))


def share_interval(counts: TrialCounts, confidence: float) -> Interval:
    """Return the shares that the trials do not exclude: each bound holds with `confidence`, at all times at once."""
    outside = TrialCounts(counts.trials - counts.within, counts.trials)
    return Interval(_lower_bound(counts, confidence), 1.0 - _lower_bound(outside, confidence))


def monotone_fractions(ranks: Sequence[TrialCounts]) -> List[float]:
    """Fit fractions that do not fall from rank to rank, by pooling adjacent violators.

    Args:
        ranks: of ascending quality, each with trials.
    """
    pools: List[TrialCounts] = []
    sizes: List[int] = []
    for counts in ranks:
        pool, size = counts, 1
        while pools and pools[-1].fraction >= pool.fraction:
            lower = pools.pop()
            pool, size = TrialCounts(lower.within + pool.within, lower.trials + pool.trials), size + sizes.pop()
        pools.append(pool)
        sizes.append(size)
    return [pool.fraction for pool, size in zip(pools, sizes) for _ in range(size)]


def _enough(within: np.ndarray, trials: np.ndarray, share: float, doubt: float) -> np.ndarray:
    return np.asarray(log_evidence_for(within, trials, share) >= -np.log(doubt))


def _too_few(within: np.ndarray, trials: np.ndarray, share: float, doubt: float) -> np.ndarray:
    """Judge tests along the first axis."""
    evidence = log_evidence_against(within, trials, share)
    return np.asarray(np.logaddexp.reduce(evidence, axis=0) - np.log(len(evidence)) >= -np.log(doubt))


def _log_mass_above(share: float, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Compute the logarithm of the integral of x^(a - 1) (1 - x)^(b - 1) from `share` to 1."""
    return np.asarray(special.betaln(a, b) + np.log(special.betainc(b, a, 1.0 - share)))


def _lower_bound(counts: TrialCounts, confidence: float) -> float:
    """Return the largest share that is shown to be exceeded; 0 without one."""
    within, trials = np.array(counts.within), np.array(counts.trials)

    def beyond(share: float) -> float:
        return float(log_evidence_for(within, trials, share) + np.log1p(-confidence))

    if counts.within == 0 or beyond(MARGIN) <= 0.0:
        return 0.0
    return float(optimize.brentq(beyond, MARGIN, counts.fraction - MARGIN))


Q = TypeVar('Q')  # questions, whatever they are

# Of each test by each question, whether each trial ended within the tolerance, in the order of their numbers.
Outcomes = Mapping[str, Mapping[Q, Sequence[bool]]]

# Takes a rank and a number, and runs so many first trials of each test that are not there yet.
RunTrials = Callable[[int, int], Outcomes[Q]]

# Below the highest rank, trials end that would probably take more than so many times the allowed number to decide.
PATIENCE = 2


class Asked(NamedTuple):
    """What is asked of an encoder, and how many trials may answer it."""

    share: float = REQUIRED_FRACTION  # of the trials of each test that must end within the tolerance
    confidence: float = LEVEL
    most_trials: int = 60  # of each test with each encoder

    @property
    def doubt(self) -> float:
        """Return the chance of error that is left."""
        return 1.0 - self.confidence


def fewest_trials(asked: Asked) -> int:
    """Return how many trials show the share if none fails."""
    count = 1
    while not shows_enough(TrialCounts(count, count), asked.share, asked.doubt):
        count += 1
    return count


class RankTrials(Generic[Q]):
    """The trials so far, by rank."""

    def __init__(self, run: RunTrials[Q]) -> None:
        """Begin without trials; `run` runs them."""
        self._run = run
        self._done: Dict[int, int] = {}
        self._outcomes: Dict[int, Outcomes[Q]] = {}

    @property
    def ranks(self) -> List[int]:
        """Return those with trials, ascending."""
        return sorted(self._outcomes)

    @property
    def total(self) -> int:
        """Return how many trials of each test there are at all ranks together."""
        return sum(self._done.values())

    def run(self, rank: int, count: int) -> None:
        """Run the trials up to a number that are not there yet."""
        if count > self._done.get(rank, 0):
            self._outcomes[rank] = self._run(rank, count)
            self._done[rank] = count

    def done(self, rank: int) -> int:
        """Return how many trials of each test a rank has."""
        return self._done[rank]

    def counts(self, rank: int, question: Q) -> Dict[str, TrialCounts]:
        """Return the trials of each test by a question."""
        return {
            test: TrialCounts(sum(outcomes[question]), len(outcomes[question]))
            for test, outcomes in self._outcomes[rank].items()
        }


class RankJudge(Generic[Q]):
    """Judges ranks for one question. The highest rank comes first.

    What suffices in a test at one rank suffices at those above, and what does not at one rank does not at those below.
    Each rank that comes after one which was not shown to suffice is judged with half of its doubt, so that a search
    through many that nearly suffice does not find one of them by chance.
    """

    def __init__(self, trials: RankTrials[Q], question: Q, asked: Asked) -> None:
        """Begin without ranks.

        Args:
            trials: of all questions.
            question: to judge.
            asked: of each rank.
        """
        self._trials = trials
        self._question = question
        self._asked = asked
        self._doubts: Dict[int, float] = {}

    @property
    def ranks(self) -> List[int]:
        """Return those judged so far, ascending."""
        return sorted(self._doubts)

    def settle(self, rank: int) -> Sufficiency:
        """Run trials until they decide, or there may be no more of them, or it would take far too many."""
        if rank not in self._doubts:
            self._doubts[rank] = self._asked.doubt * 0.5 ** sum(
                self.kind(other) is not Sufficiency.YES for other in self.ranks
            )
        most = self._asked.most_trials
        for count in looks(self._asked.share, self._doubts[rank], most) or (most,):
            self._trials.run(rank, count)
            if self.kind(rank) is not Sufficiency.UNDECIDED or self._is_hopeless(rank):
                break
        return self.kind(rank)

    def kind(self, rank: int) -> Sufficiency:
        """Judge a rank by the trials of all that were gone to."""
        if self._suffices(rank):
            return Sufficiency.YES
        above = (other for other in self.ranks if other >= rank)
        if any(shows_too_few(self._tests(other), self._asked.share, self._doubts[other]) for other in above):
            return Sufficiency.NO
        return Sufficiency.UNDECIDED

    def lowest_sufficient(self) -> int:
        """Return the lowest rank that is shown to suffice; there must be one."""
        return next(rank for rank in self.ranks if self._suffices(rank))

    def more_trials(self, rank: int) -> Optional[int]:
        """Return how many more of each test would probably decide by themselves."""
        return more_trials(self._tests(rank), self._asked.share, self._doubts[rank])

    def _suffices(self, rank: int) -> bool:
        """Return whether each test is shown to have enough, at this rank or one below."""
        below = [other for other in self.ranks if other <= rank]
        shown = [
            [shows_enough(counts, self._asked.share, self._doubts[other]) for counts in self._tests(other)]
            for other in below
        ]
        return all(map(any, zip(*shown)))

    def _tests(self, rank: int) -> List[TrialCounts]:
        return list(self._trials.counts(rank, self._question).values())

    def _is_hopeless(self, rank: int) -> bool:
        if rank == self.ranks[-1]:
            return False
        more = self.more_trials(rank)
        return more is None or self._trials.done(rank) + more > PATIENCE * self._asked.most_trials


class RankAnswer(NamedTuple):
    """The answer to a question.

    YES: an encoder suffices from `rank` on. NO: not even the highest one does. UNDECIDED: whether that one does.
    """

    kind: Sufficiency
    rank: Optional[int] = None  # the lowest that is shown to suffice
    insufficient: Optional[int] = None  # the highest below it that is shown not to; of NO the highest of all
    undecided: Optional[int] = None  # the rank where more trials say most: right below `rank`, or the highest
    more_trials: Optional[int] = None  # of each test there, which would probably decide; None: too many to say


class EncoderSearch(Generic[Q]):
    """Searches for the answers to several questions, running trials as needed."""

    def __init__(self, ranks: int, run: RunTrials[Q], asked: Asked) -> None:
        """Prepare the search.

        Args:
            ranks: how many encoders there are.
            run: runs the first trials of a rank.
            asked: of each encoder.
        """
        self._top = ranks - 1
        self._asked = asked
        self._trials = RankTrials(run)

    def answers(self, guesses: Mapping[Q, int]) -> Dict[Q, RankAnswer]:
        """Answer each question, given a first guess of its lowest sufficient rank.

        In the end the ranks beside that of each answer have trials, too, paired with its own.
        """
        judges = {question: RankJudge(self._trials, question, self._asked) for question in guesses}
        before = -1
        while before != self._trials.total:  # the trials for one question may tell more about another
            before = self._trials.total
            for question, guess in guesses.items():
                self._search(judges[question], guess)
        found = {question: self._answer(judge) for question, judge in judges.items()}
        for answer in found.values():
            self._run_beside(answer.rank)
        return found

    def counts(self, question: Q) -> Dict[int, Dict[str, TrialCounts]]:
        """Return the trials of each test by rank, ascending: all that there are."""
        return {rank: self._trials.counts(rank, question) for rank in self._trials.ranks}

    def _search(self, judge: RankJudge[Q], guess: int) -> None:
        """Go from the guess down while ranks suffice, or up until one does, by growing steps; then close the gap.

        The gap lies between the lowest rank that is shown to suffice and the next below that is not, be that shown not
        to or undecided.
        """
        if judge.settle(self._top) is not Sufficiency.YES:
            return
        judge.settle(guess)
        step = 1
        while True:
            high = judge.lowest_sufficient()
            low = max((rank for rank in judge.ranks if rank < high), default=-1)
            if high - low == 1:
                return
            goes_up = high == self._top and low >= 0
            rank = min(low + step, high - 1) if goes_up else max(high - step, low + 1)
            goes_on = (judge.settle(rank) is Sufficiency.YES) != goes_up
            step = 2 * step if goes_on else 1

    def _answer(self, judge: RankJudge[Q]) -> RankAnswer:
        kinds = {rank: judge.kind(rank) for rank in judge.ranks}
        if Sufficiency.YES not in kinds.values():
            kind = kinds[self._top]
            if kind is Sufficiency.NO:
                return RankAnswer(kind, insufficient=self._top)
            return RankAnswer(kind, undecided=self._top, more_trials=judge.more_trials(self._top))
        high = judge.lowest_sufficient()
        low = max((rank for rank, kind in kinds.items() if kind is Sufficiency.NO and rank < high), default=None)
        answer = RankAnswer(Sufficiency.YES, high, low)
        if high - 1 in (-1, low):
            return answer
        return answer._replace(undecided=high - 1, more_trials=judge.more_trials(high - 1))

    def _run_beside(self, rank: Optional[int]) -> None:
        if rank is not None:
            some = (fewest_trials(self._asked) + 1) // 2
            for beside in (rank - 1, rank + 1):
                if 0 <= beside <= self._top:
                    self._trials.run(beside, some)
