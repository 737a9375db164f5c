"""The closed-loop part of an advice: trials with a few of the candidates, and what they say."""

from __future__ import annotations

import functools
from typing import Any, Callable, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.advice.advice import Advice, TriedEncoder
from diff_encoder_sim.advice.answers import (
    MOST_BY_ONE_CAUSE,
    Answer,
    Budget,
    Criterion,
    Kind,
    Requirement,
    added,
    along_goal,
    limits,
    part_of,
)
from diff_encoder_sim.advice.drawn_robot import ALL_CAUSES, WheelCause
from diff_encoder_sim.advice.encoder_search import Asked, EncoderSearch, Outcomes, RankAnswer, TrialCounts
from diff_encoder_sim.advice.listed_encoders import candidates_of
from diff_encoder_sim.advice.odometry_answer import EDGES, MISSED, SENSOR_ERRORS, UNEVEN_LINES
from diff_encoder_sim.advice.odometry_curve import local_counts
from diff_encoder_sim.advice.odometry_study import geometry_of
from diff_encoder_sim.analysis.dataset import TrialData
from diff_encoder_sim.analysis.encoder_labels import ppr_text
from diff_encoder_sim.analysis.within_tolerance import Sufficiency
from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.params import flat
from diff_encoder_sim.base.se2 import Pose2D, wrap_angles
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.navigation.goal_stopping import StopSpread
from diff_encoder_sim.simulation.simulator import WheelErrorParams
from diff_encoder_sim.trials.campaign_cells import Campaign
from diff_encoder_sim.trials.robot_params import RobotParams, parts_with
from diff_encoder_sim.wheels.encoder_params import IDEAL_ENCODER, NO_FAULTS

AS_IT_IS, WITHOUT_ALL = 'as it is', 'without all of these'
_WITHOUT = 'without '

_WHEELS, _ENCODER, _FAULTS = 'simulator.wheel_errors', 'config.encoder', 'config.encoder.faults'

# The keys of each cause.
_CAUSES: Mapping[str, Mapping[str, Sequence[str]]] = {
    WheelCause.RADIUS.value: {_WHEELS: ('left_radius_error', 'right_radius_error', 'radius_spread')},
    WheelCause.SEPARATION.value: {_WHEELS: ('wheel_separation_error', 'wheel_separation_spread')},
    WheelCause.SLIP.value: {_WHEELS: ('left_slip', 'right_slip', 'slip_noise')},
    EDGES: {_ENCODER: (*SENSOR_ERRORS, *UNEVEN_LINES)},
    MISSED: {_FAULTS: ('missed', 'extra', 'max_count_rate', 'dead_channel', 'restart_at', 'wiring')},
}

_SOUND = {
    **{f'{_WHEELS}.{key}': value for key, value in flat(WheelErrorParams().model_dump())},
    **{f'{_ENCODER}.{key}': value for key, value in flat(IDEAL_ENCODER.model_dump(exclude={'faults'}))},
    **{f'{_FAULTS}.{key}': value for key, value in flat(NO_FAULTS.model_dump())},
}


def switched_off(robots: Sequence[RobotParams]) -> Dict[str, Dict[str, Any]]:
    """Return, by the name of a set of parameters, the values without each cause that one of the robots has.

    The first set is the robot as it is, the last one without all of these causes; {} where there is no cause.

    Args:
        robots: with each encoder.
    """
    values = [_values(robot) for robot in robots]
    without: Dict[str, Dict[str, Any]] = {}
    for cause, by_part in _CAUSES.items():
        keys = [f'{part}.{key}' for part, names in by_part.items() for key in names]
        if any(of_robot[key] != _SOUND[key] for of_robot in values for key in keys):
            without[f'{_WITHOUT}{cause}'] = {key: _SOUND[key] for key in keys}
    if not without:
        return {}
    every = {key: value for each in without.values() for key, value in each.items()}
    return {AS_IT_IS: {}, **without, WITHOUT_ALL: every}


def cause_of(variant: str) -> str:
    """Return the cause that a set of parameters is without."""
    return variant[len(_WITHOUT) :]


def _values(robot: RobotParams) -> Dict[str, Any]:
    wheels, encoder = robot.simulator.wheel_errors.model_dump(), robot.encoder.encoder.model_dump()
    return {
        **{f'{_WHEELS}.{key}': value for key, value in flat(wheels)},
        **{f'{_ENCODER}.{key}': value for key, value in flat(encoder)},
    }


STOPPING, LOCALIZATION, ENCODER = 'stopping', 'localization', 'encoder'

# The pose that each criterion about the goal is asked of.
SOURCES = {Criterion.POSE_ESTIMATE: PoseSource.GLOBAL, Criterion.TRUTH: PoseSource.WORLD}


class Ends(NamedTuple):
    """Where trials that came to their goal ended, (n, 3) by the axes of budgets."""

    numbers: np.ndarray  # (n,) of the trials
    stopping: np.ndarray  # pose estimate minus goal
    localization: np.ndarray  # true pose minus pose estimate
    odometry: np.ndarray  # odometry minus true pose

    @property
    def truth(self) -> np.ndarray:
        """Return the true pose minus the goal."""
        return _wrapped(self.stopping + self.localization)

    def only(self, numbers: np.ndarray) -> Ends:
        """Return those of some trials."""
        is_one = np.isin(self.numbers, numbers)
        return Ends(*(part[is_one] for part in self))


def paired(every: Sequence[Ends]) -> List[Ends]:
    """Return the ends of the trials that all of these have."""
    common = functools.reduce(np.intersect1d, (ends.numbers for ends in every))
    return [ends.only(common) for ends in every]


def is_within(trial: TrialData, criterion: Criterion, requirement: Requirement) -> bool:
    """Return whether a trial ended within the tolerance.

    One that gave up did not come to its goal, wherever it stands; its odometry may be right.
    """
    if criterion is Criterion.ODOMETRY:
        error = trial.odometry_minus_truth
    else:
        error = trial.errors.get(SOURCES[criterion]) if trial.outcome is Outcome.SUCCEEDED else None
    return error is not None and bool(requirement.within(np.array([error]))[0])


def ends_of(trials: Sequence[TrialData], goal_in_map: Pose2D) -> Ends:
    """Return where the trials ended that came to their goal."""
    sources = PoseSource.GLOBAL, PoseSource.WORLD, PoseSource.ODOM
    found: List[List[Pose2D]] = []
    numbers: List[int] = []
    for trial in sorted(trials, key=lambda trial: trial.trial):
        errors = [trial.errors.get(source) for source in sources]
        if trial.outcome is Outcome.SUCCEEDED and None not in errors:
            found.append([error for error in errors if error is not None])
            numbers.append(trial.trial)
    estimate, truth, odometry = np.array(found, dtype=float).reshape(-1, 3, 3).transpose(1, 0, 2)
    parts = estimate, truth - estimate, odometry - truth
    return Ends(np.array(numbers, dtype=int), *(along_goal(_wrapped(part), goal_in_map) for part in parts))


def truth_budget(ends: Ends, of_finest: Ends, sound: Ends, without: Mapping[str, Ends]) -> Budget:
    """Return what adds up to the true pose's error at the goal.

    Args:
        ends: with an encoder; all of the same trials.
        of_finest: with the finest encoder: what the encoder adds to that.
        sound: with the finest encoder, and without the causes that are switched off.
        without: as `ends`, without one cause each.
    """
    switched = {cause: added(ends.truth, others.truth) for cause, others in without.items()}
    parts = {
        STOPPING: part_of(sound.stopping),
        LOCALIZATION: part_of(sound.localization),
        ENCODER: added(ends.truth, of_finest.truth),
        **switched,
    }
    return Budget(parts, part_of(ends.truth))


def causes_alone(criterion: Criterion, ends: Mapping[str, Ends]) -> Dict[str, Dict[str, np.ndarray]]:
    """Return, by cause and test, the errors at the goal that each cause makes by itself."""
    of_stop = {STOPPING: {test: each.stopping for test, each in ends.items()}}
    if criterion is Criterion.POSE_ESTIMATE:
        return of_stop
    return {**of_stop, LOCALIZATION: {test: each.localization for test, each in ends.items()}}


def reduced(criterion: Criterion, ends: Ends, amounts: Mapping[str, float]) -> np.ndarray:
    """Return (n, 3) errors at the goal by the axes of budgets, with so much of each cause; all where none is given."""
    stopping = amounts.get(STOPPING, 1.0) * ends.stopping
    if criterion is Criterion.POSE_ESTIMATE:
        return stopping
    return _wrapped(stopping + amounts.get(LOCALIZATION, 1.0) * ends.localization)


def _wrapped(errors: np.ndarray) -> np.ndarray:
    return np.column_stack([errors[:, :2], wrap_angles(errors[:, 2])])


stats = deferred('scipy.stats')

# So many trials of each test compare the curve of odometry with closed-loop trials: at its encoder and those beside it.
CONFIRMING = 6

# The draws that trials are compared with, and how often they seem to disagree where they do not, at most.
DRAWS, FALSE_ALARM = 2000, 0.01

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
        self._geometry, self._robot_params = geometry_of(campaign), campaign.cells[0].robot_params
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
        answers = {Criterion.ODOMETRY: odometry, **answers}
        return self._advice._replace(answers=answers, stopping=self._stopping(answers), tried=self._tried())

    def _run(self, rank: int, count: int) -> Outcomes[Criterion]:
        as_it_is = self._variants[0] if self._variants else ''
        self._trials[rank] = self._trials_with(self._candidates[rank].label, count, as_it_is)
        return {
            test: {
                criterion: [
                    is_within(trial, criterion, self._advice.requirement) for trial in self._of_test(rank, test)
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
        """Say so where trials end otherwise than the draws of one drive let expect, with one encoder in one test."""
        cells = [(rank, curve) for rank in sorted(self._trials) for curve in self._advice.curves.curves]
        for rank, curve in cells:
            counts = self._counts(self._of_test(rank, curve.test), Criterion.ODOMETRY)
            candidate = self._candidates[rank]
            (errors,) = curve.draws.errors([candidate.params], DRAWS, ALL_CAUSES)
            expected = int(self._advice.requirement.within(errors).sum())
            # Of draws without exception the share is not 1, and trials of other encoders are no other draws.
            share = (expected + 0.5) / (len(errors) + 1.0)
            if counts.trials and stats.binomtest(counts.within, counts.trials, share).pvalue < FALSE_ALARM / len(cells):
                return (
                    f'but of {counts.trials} trials of {curve.test} with {ppr_text(candidate.label)} {counts.within} '
                    f'are within the tolerance, where the draws let expect {share * counts.trials:.1f}'
                )
        return ''

    def _stopping(self, answers: Mapping[Criterion, Answer]) -> Dict[str, Dict[str, StopSpread]]:
        """Return the stop's spread with the encoders of the answers, or with the finest one where there is none."""
        labels = [answer.encoder for answer in answers.values() if answer.encoder] or [self._candidates[-1].label]
        ppr = {candidate.label: candidate.params.counts_per_turn for candidate in self._candidates}
        return {label: parts_with(self._robot_params, ppr[label]) for label in dict.fromkeys(labels)}

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
        finest = max(self._trials)
        found = limits(causes_alone(criterion, self._ends(finest)), self._advice.requirement)
        amounts = {limit.cause: limit.reduced_to / limit.error for limit in found}
        enough = None
        for rank in sorted(self._trials, reverse=True):
            if not found or self._share_with(rank, criterion, amounts) < self._advice.requirement.share:
                break
            enough = self._candidates[rank]
        label = enough.label if enough else ''
        answer = Answer(criterion, Kind.NOT_THE_LIMIT, enough and enough.counts, encoder=label, limits=found)
        return answer._replace(given_up=self._given_up(finest))

    def _share_with(self, rank: int, criterion: Criterion, amounts: Mapping[str, float]) -> float:
        """Return the share of the trials within the tolerance with so much of each cause, in the worst test."""
        shares = []
        for test, ends in self._ends(rank).items():
            within = self._advice.requirement.within(reduced(criterion, ends, amounts)).sum()
            shares.append(float(within) / len(self._of_test(rank, test)))
        return min(shares)

    def _given_up(self, rank: int) -> str:
        """Say in which tests too many trials did not come to their goal, and why the first of them did not."""
        texts = []
        for test in self._goals:
            trials = self._of_test(rank, test)
            failed = [trial for trial in trials if trial.outcome is not Outcome.SUCCEEDED]
            if len(failed) > MOST_BY_ONE_CAUSE * (1.0 - self._advice.requirement.share) * len(trials):
                first = failed[0]
                reason = f'{first.outcome.text}{first.reason and f": {first.reason}"}'
                texts.append(f'{len(failed)} of {len(trials)} trials of {test} do not come to the goal ({reason})')
        return ' and '.join(texts)

    def _of_test(self, rank: int, test: str) -> List[TrialData]:
        return [trial for trial in self._trials[rank] if trial.test == test]

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
                trials = self._of_test(rank, test)
                tried.append(
                    TriedEncoder(
                        test,
                        candidate.label,
                        candidate.counts,
                        {criterion: self._counts(trials, criterion) for criterion in Criterion},
                        *self._budget(rank, test),
                    )
                )
        return tried

    def _counts(self, trials: Sequence[TrialData], criterion: Criterion) -> TrialCounts:
        return TrialCounts(sum(is_within(trial, criterion, self._advice.requirement) for trial in trials), len(trials))

    def _budget(self, rank: int, test: str) -> Tuple[Optional[Budget], int]:
        """Return the budget of the true pose, with the causes that were switched off, and of how many trials it is."""
        finest = self._ends(max(self._trials))[test]
        sound, without = finest, {}
        for (place, variant), trials in self._switched.items():
            if variant == WITHOUT_ALL:
                sound = self._ends_of(trials)[test]
            elif place == rank:
                without[cause_of(variant)] = self._ends_of(trials)[test]
        ends, finest, sound, *others = paired([self._ends(rank)[test], finest, sound, *without.values()])
        count = len(ends.numbers)
        if count < FEWEST_FOR_BUDGET:
            return None, count
        return truth_budget(ends, finest, sound, dict(zip(without, others))), count
