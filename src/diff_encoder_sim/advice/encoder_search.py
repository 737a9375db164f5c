"""Searches the lowest encoder that suffices: by trials of a few, around a first guess of which it is.

Encoders have ranks from 0 on, of ascending quality; one of a higher rank is taken to be no worse. Several questions are
asked of the same trials, those of equal number being paired; each looks only at the ranks that it came to.
"""

from __future__ import annotations

from typing import Dict, Generic, Mapping, NamedTuple, Optional

from diff_encoder_sim.advice.evidence import TrialCounts
from diff_encoder_sim.advice.rank_judge import Asked, Q, RankJudge, RankTrials, RunTrials, fewest_trials
from diff_encoder_sim.analysis.within_tolerance import Sufficiency


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
