"""The closed-loop part of an advice: trials with a few of the candidates, and what they say."""

from __future__ import annotations

import math
from typing import Callable, Dict, List, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.advice.advice import Advice, TriedEncoder
from diff_encoder_sim.advice.answers import Answer, Criterion, Kind
from diff_encoder_sim.advice.budget import Budget
from diff_encoder_sim.advice.candidates import candidates_of
from diff_encoder_sim.advice.closed_form_counts import local_counts
from diff_encoder_sim.advice.encoder_search import EncoderSearch, RankAnswer
from diff_encoder_sim.advice.evidence import TrialCounts
from diff_encoder_sim.advice.limits import limits
from diff_encoder_sim.advice.odometry_study import geometry_of
from diff_encoder_sim.advice.rank_judge import Asked, Outcomes
from diff_encoder_sim.advice.switched_causes import WITHOUT_ALL, cause_of
from diff_encoder_sim.advice.trial_errors import SOURCES, Ends, causes_alone, ends_of, is_within, reduced, truth_budget
from diff_encoder_sim.analysis.dataset import TrialData
from diff_encoder_sim.analysis.within_tolerance import Sufficiency
from diff_encoder_sim.campaign.campaign_definition import Campaign

# So many trials of each test compare the curve of odometry with closed-loop trials: at its encoder and those beside it.
CONFIRMING = 8

# The draws that trials are compared with, and beyond how many standard deviations they disagree: once in 300.
DRAWS, DEVIATIONS = 1000, 3.0

# Of fewer trials a variance says too little for a budget.
FEWEST_FOR_BUDGET = 8

# Trials of each test without a cause.
WITHOUT_CAUSE = 17

# Runs the first trials of each test with an encoder, by its label, and a set of parameters, and returns them.
TrialsWith = Callable[[str, int, str], Sequence[TrialData]]


class TrialStudy:
    """Runs trials as they are needed."""

    def __init__(self, campaign: Campaign, advice: Advice, trials_with: TrialsWith, most_trials: int) -> None:
        """Prepare.

        Args:
            campaign: of the candidates.
            advice: what is known by the odometry of single drives.
            trials_with: runs trials.
            most_trials: of each test with each encoder.
        """
        self._advice, self._trials_with = advice, trials_with
        self._candidates = candidates_of(campaign)
        self._goals = {cell.test.name: cell.test.goal() for cell in campaign.cells}
        self._geometry = geometry_of(campaign)
        self._variants = list(campaign.params.variants)
        self._trials: Dict[int, Sequence[TrialData]] = {}
        self._switched: Dict[Tuple[int, str], Sequence[TrialData]] = {}
        asked = Asked(advice.requirement.share, advice.requirement.confidence, most_trials)
        self._search = EncoderSearch(len(self._candidates), self._run, asked)

    def advice(self) -> Advice:
        """Run the trials, and return the advice with what they say."""
        first = self._rank_from(local_counts(self._geometry, self._advice.requirement))
        found = self._search.answers(dict.fromkeys(SOURCES, first))
        odometry = self._confirmed(self._advice.answers[Criterion.ODOMETRY])
        answers = {criterion: self._answer(criterion, found[criterion]) for criterion in SOURCES}
        self._switch_off(answers[Criterion.TRUTH])
        return self._advice._replace(answers={Criterion.ODOMETRY: odometry, **answers}, tried=self._tried())

    def _run(self, rank: int, count: int) -> Outcomes[Criterion]:
        as_it_is = self._variants[0] if self._variants else ''
        trials = self._trials[rank] = self._trials_with(self._candidates[rank].label, count, as_it_is)
        return {
            test: {
                criterion: [
                    is_within(trial, criterion, self._advice.requirement) for trial in trials if trial.test == test
                ]
                for criterion in SOURCES
            }
            for test in self._goals
        }

    def _rank_from(self, counts: float) -> int:
        """Return the first candidate with so many counts, or the last."""
        enough = (rank for rank, candidate in enumerate(self._candidates) if candidate.counts >= counts)
        return next(enough, len(self._candidates) - 1)

    def _confirmed(self, answer: Answer) -> Answer:
        """Compare the draws with trials at the encoder that they recommend, one below and one above."""
        labels = [candidate.label for candidate in self._candidates]
        if not answer.encoder:
            return answer
        rank = labels.index(answer.encoder)
        for beside in (rank - 1, rank, rank + 1):
            if 0 <= beside < len(labels) and beside not in self._trials:
                self._run(beside, CONFIRMING)
        return answer._replace(note=self._disagreement())

    def _disagreement(self) -> str:
        """Say so where trials end otherwise than the draws of one drive let expect."""
        within, expected, variance = 0, 0.0, 0.0
        for rank, trials in self._trials.items():
            for curve in self._advice.curves.curves:
                of_test = [trial for trial in trials if trial.test == curve.test]
                (errors,) = curve.draws.errors([self._candidates[rank].params], DRAWS)
                share = float(np.mean(self._advice.requirement.within(errors)))
                within += self._counts(of_test, Criterion.ODOMETRY).within
                expected += len(of_test) * share
                variance += len(of_test) * share * (1.0 - share)
        if abs(within - expected) - 0.5 <= DEVIATIONS * math.sqrt(variance):
            return ''
        return f'but of the trials {within} are within the tolerance, where the draws let expect {expected:.0f}'

    def _switch_off(self, truth: Answer) -> None:
        """Run trials without each cause, with the encoder of the answer; without all of them with the finest one."""
        if not self._variants:
            return
        labels = [candidate.label for candidate in self._candidates]
        rank = labels.index(truth.encoder) if truth.encoder else max(self._trials)
        *without, without_all = self._variants[1:]
        for place, variant in (*((rank, name) for name in without), (max(self._trials), without_all)):
            self._switched[place, variant] = self._trials_with(labels[place], WITHOUT_CAUSE, variant)

    def _answer(self, criterion: Criterion, found: RankAnswer) -> Answer:
        if found.kind is Sufficiency.YES and found.rank is not None:
            chosen = self._candidates[found.rank]
            below = None if found.insufficient is None else self._candidates[found.insufficient].counts
            return Answer(
                criterion,
                Kind.FROM,
                chosen.counts,
                (below, chosen.counts),
                chosen.label,
                more_trials=found.more_trials,
                undecided='' if found.undecided is None else self._candidates[found.undecided].label,
            )
        if found.kind is Sufficiency.NO:
            return self._limited(criterion)
        return Answer(criterion, Kind.UNDECIDED, more_trials=found.more_trials)

    def _limited(self, criterion: Criterion) -> Answer:
        """Name what is too large even with the finest encoder, and say which encoder would do with less of it."""
        requirement = self._advice.requirement
        found = limits(causes_alone(criterion, self._ends(max(self._trials))), requirement)
        amounts = {limit.cause: limit.reduced_to / limit.error for limit in found}
        enough = None
        for rank in sorted(self._trials, reverse=True):
            of_tests = self._ends(rank).values()
            shares = [np.mean(requirement.within(reduced(criterion, ends, amounts))) for ends in of_tests]
            if not found or min(shares) < requirement.share:
                break
            enough = self._candidates[rank]
        return Answer(
            criterion,
            Kind.NOT_THE_LIMIT,
            enough and enough.counts,
            encoder=enough.label if enough else '',
            limits=found,
        )

    def _ends(self, rank: int) -> Dict[str, Ends]:
        return self._ends_of(self._trials[rank])

    def _ends_of(self, trials: Sequence[TrialData]) -> Dict[str, Ends]:
        return {
            test: ends_of([trial for trial in trials if trial.test == test], goal) for test, goal in self._goals.items()
        }

    def _tried(self) -> List[TriedEncoder]:
        tried = []
        for rank in sorted(self._trials):
            candidate = self._candidates[rank]
            for test in self._goals:
                trials = [trial for trial in self._trials[rank] if trial.test == test]
                tried.append(
                    TriedEncoder(
                        test,
                        candidate.label,
                        candidate.counts,
                        {criterion: self._counts(trials, criterion) for criterion in Criterion},
                        self._budget(rank, test),
                    )
                )
        return tried

    def _counts(self, trials: Sequence[TrialData], criterion: Criterion) -> TrialCounts:
        return TrialCounts(sum(is_within(trial, criterion, self._advice.requirement) for trial in trials), len(trials))

    def _budget(self, rank: int, test: str) -> Optional[Budget]:
        """Return the budget of the true pose, with the causes that were switched off; None of too few trials."""
        ends, finest = self._ends(rank)[test], self._ends(max(self._trials))[test]
        sound, without = finest, {}
        for (place, variant), trials in self._switched.items():
            if variant == WITHOUT_ALL:
                sound = self._ends_of(trials)[test]
            elif place == rank:
                without[cause_of(variant)] = self._ends_of(trials)[test]
        if min(len(each.stopping) for each in (ends, finest, sound, *without.values())) < FEWEST_FOR_BUDGET:
            return None
        return truth_budget(ends, finest, sound, without)
