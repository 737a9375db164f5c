"""Judges encoders of ascending quality, their ranks, by trials of some of them."""

from __future__ import annotations

from typing import Callable, Dict, Generic, List, Mapping, NamedTuple, Optional, Sequence, TypeVar

from diff_encoder_sim.advice.evidence import TrialCounts, looks, more_trials, shows_enough, shows_too_few
from diff_encoder_sim.analysis.confidence import LEVEL
from diff_encoder_sim.analysis.quantities import REQUIRED_FRACTION
from diff_encoder_sim.analysis.within_tolerance import Sufficiency

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
