"""Closed-loop part of an advice: trials with some candidates, their answers and their budget."""

from __future__ import annotations

import functools
import itertools
from typing import Any, Callable, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.advice import answers
from diff_encoder_sim.advice.answers import MOST_BY_ONE_CAUSE, Answer, Budget, Criterion, Kind, Requirement
from diff_encoder_sim.advice.drive_draws import ALL_CAUSES, RADIUS, SEPARATION, SLIP
from diff_encoder_sim.advice.encoder_search import TrialCounts, search
from diff_encoder_sim.advice.odometry_answer import EDGES, MISSED, SENSOR_ERRORS, UNEVEN_LINES, local_counts
from diff_encoder_sim.advice.odometry_study import Advice, TriedEncoder, candidates_of
from diff_encoder_sim.analysis.encoder_labels import ppr_text
from diff_encoder_sim.analysis.results_table import SUCCEEDED
from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.deferred import pandas as pd
from diff_encoder_sim.base.params import flat
from diff_encoder_sim.base.se2 import Pose2D, wrap_angles
from diff_encoder_sim.simulation.slip import WheelErrorParams, WheelSlipParams
from diff_encoder_sim.trials.campaign_cells import Campaign
from diff_encoder_sim.trials.robot_params import RobotParams, parts_with
from diff_encoder_sim.trials.trials_csv import PARTS
from diff_encoder_sim.wheels.encoder_params import IDEAL_ENCODER

stats = deferred('scipy.stats')

AS_IT_IS, WITHOUT, WITHOUT_ALL = 'as it is', 'without ', 'without all of these'
STOPPING, LOCALIZATION, ENCODER = 'stopping', 'localization', 'encoder'
AT_GOAL = (Criterion.POSE_ESTIMATE, Criterion.TRUTH)

FEWEST_FOR_BUDGET = 8  # trials; with fewer the variances of a budget are too uncertain

# Odometry of closed-loop trials is compared with this number of sampled drives; chance of a false alarm.
DRAWS, FALSE_ALARM = 2000, 0.01

SLIP_KEYS = [f'slip.{name}' for name in WheelSlipParams.model_fields]
_CAUSES: Mapping[str, Tuple[str, Sequence[str]]] = {  # keys
    RADIUS: ('simulator.wheel_errors', ('left_radius_error', 'right_radius_error', 'radius_spread')),
    SEPARATION: ('simulator.wheel_errors', ('wheel_separation_error', 'wheel_separation_spread')),
    SLIP: ('simulator.wheel_errors', ('left_slip', 'right_slip', 'slip_noise', *SLIP_KEYS)),
    EDGES: ('config.encoder', (*SENSOR_ERRORS, *UNEVEN_LINES)),
    MISSED: ('config.encoder.faults', ('missed', 'extra', 'max_count_rate', 'dead_channel', 'restart_at', 'wiring')),
}


def switched_off(robots: Sequence[RobotParams]) -> Dict[str, Dict[str, Any]]:
    """Return parameter sets by name, each without one cause that the robot has with any of its encoders.

    The first set is the unchanged robot, the last one is without all causes; {} if there are no causes.
    """
    sound = _values(WheelErrorParams(), IDEAL_ENCODER)
    values = [_values(robot.simulator.wheel_errors, robot.encoder.encoder) for robot in robots]
    without = {}
    for cause, (parent, names) in _CAUSES.items():
        keys = [f'{parent}.{name}' for name in names]
        if any(of_robot[key] != sound[key] for of_robot in values for key in keys):
            without[f'{WITHOUT}{cause}'] = {key: sound[key] for key in keys}
    every = {key: value for each in without.values() for key, value in each.items()}
    return {AS_IT_IS: {}, **without, WITHOUT_ALL: every} if without else {}


def _values(wheels: WheelErrorParams, encoder: Any) -> Dict[str, Any]:
    return dict(flat({'simulator': {'wheel_errors': wheels.model_dump()}, 'config': {'encoder': encoder.model_dump()}}))


# Runs the trials of each test with an encoder (label) and a parameter set (name), and returns the results table.
TrialsWith = Callable[[str, str], 'pd.DataFrame']


class GoalTrials(NamedTuple):
    """Trials of one test with one encoder, ascending by number. Errors are (n, 3): x [m], y [m], yaw [rad].

    Errors are poses minus the goal in the axes of the map; NaN if unknown.
    """

    goal_in_map: Pose2D
    numbers: np.ndarray  # (n,)
    succeeded: np.ndarray  # (n,) bool: reached the goal
    estimate: np.ndarray
    truth: np.ndarray
    odometry: np.ndarray
    failure: str = ''  # outcome and reason of the first failed trial

    def counts(self, criterion: Criterion, requirement: Requirement) -> TrialCounts:
        """Count the trials within the tolerance; an aborted one is not at its goal, but its odometry may count."""
        if criterion is Criterion.ODOMETRY:
            within = requirement.within(wrapped(self.odometry - self.truth))
        else:
            errors = self.truth if criterion is Criterion.TRUTH else self.estimate
            within = self.succeeded & requirement.within(errors)
        return TrialCounts(int(within.sum()), len(self.numbers))

    def causes(self, numbers: Optional[np.ndarray] = None) -> Dict[str, np.ndarray]:
        """Return (m, 3) errors at the goal by cause and AXES, of the trials that reached it.

        Causes: stopping (pose estimate minus goal) and localization (true pose minus pose estimate).
        """
        is_used = np.isin(self.numbers, self.known_numbers if numbers is None else numbers)
        parts = {STOPPING: self.estimate, LOCALIZATION: self.truth - self.estimate}
        return {cause: answers.along_goal(wrapped(part[is_used]), self.goal_in_map) for cause, part in parts.items()}

    @property
    def known_numbers(self) -> np.ndarray:
        """Return the numbers of the trials that reached the goal and have all poses."""
        poses = np.column_stack([self.estimate, self.truth, self.odometry])
        return np.asarray(self.numbers[self.succeeded & np.isfinite(poses).all(axis=1)])


def goal_trials(trials: pd.DataFrame, goal_in_map: Pose2D) -> GoalTrials:
    """Convert the results table of one test."""
    estimate, truth, odometry = (
        trials[[f'{pose}_{part}' for part in PARTS]].to_numpy(dtype=float) for pose in ('global', 'world', 'odom')
    )
    succeeded, failure = (trials['outcome'] == SUCCEEDED).to_numpy(), ''
    if not succeeded.all():
        outcome, reason = trials.loc[~succeeded, ['outcome', 'reason']].iloc[0]
        failure = f'{outcome.replace("_", " ")}{reason and f": {reason}"}'
    numbers = trials['trial'].to_numpy(dtype=int)
    return GoalTrials(goal_in_map, numbers, succeeded, estimate, truth, odometry, failure)


class _Runs:
    """Trials by rank and parameter set, run on first use."""

    def __init__(self, campaign: Campaign, trials_with: TrialsWith) -> None:
        self.candidates, self._trials_with = candidates_of(campaign), trials_with
        self.variants = list(campaign.params.variants) or ['']
        self._goals = {cell.test.name: cell.test.goal() for cell in campaign.cells}
        self._trials: Dict[Tuple[int, str], Dict[str, GoalTrials]] = {}

    @property
    def ranks(self) -> List[int]:
        """Return the ranks with trials, ascending."""
        return sorted({rank for rank, _ in self._trials})

    def rank_of(self, label: str) -> int:
        return [candidate.label for candidate in self.candidates].index(label)

    def trials(self, rank: int, variant: Optional[str] = None) -> Dict[str, GoalTrials]:
        """Return the trials by test; by default of the unchanged robot."""
        key = rank, self.variants[0] if variant is None else variant
        if key not in self._trials:
            found = self._trials_with(self.candidates[rank].label, key[1])
            by_test = {test: goal_trials(found[found['test'] == test], goal) for test, goal in self._goals.items()}
            self._trials[key] = by_test
        return self._trials[key]


def study_trials(campaign: Campaign, advice: Advice, trials_with: TrialsWith) -> Advice:
    """Run trials of a campaign with the candidates as encoders; add answers about pose estimate and true pose."""
    requirement, run = advice.requirement, _Runs(campaign, trials_with)
    candidates = run.candidates

    def counts(rank: int) -> Dict[Criterion, List[TrialCounts]]:
        tests = run.trials(rank).values()
        return {criterion: [test.counts(criterion, requirement) for test in tests] for criterion in AT_GOAL}

    wanted = local_counts(advice.geometry, requirement)
    guess = next((rank for rank, each in enumerate(candidates) if each.counts >= wanted), len(candidates) - 1)
    found = search(candidates, counts, dict.fromkeys(AT_GOAL, guess), requirement)
    odometry = advice.answers[Criterion.ODOMETRY]
    every = {Criterion.ODOMETRY: odometry, **found}
    for criterion in AT_GOAL:
        if found[criterion].kind is Kind.NOT_THE_LIMIT:
            every[criterion] = _limited(criterion, run, requirement)
    if odometry.encoder:
        run.trials(run.rank_of(odometry.encoder))
        every[Criterion.ODOMETRY] = odometry._replace(note=_disagreement(run, advice))
    labels = [answer.encoder for answer in every.values() if answer.encoder] or [candidates[-1].label]
    stopping = {
        label: parts_with(campaign.cells[0].robot_params, candidates[run.rank_of(label)].params.counts_per_turn)
        for label in dict.fromkeys(labels)
    }
    return advice._replace(answers=every, stopping=stopping, tried=_tried(run, every[Criterion.TRUTH], requirement))


def _limited(criterion: Criterion, run: _Runs, requirement: Requirement) -> Answer:
    """Return the causes that are too large with the finest encoder, and the encoder that suffices with less of them."""
    causes = (STOPPING,) if criterion is Criterion.POSE_ESTIMATE else (STOPPING, LOCALIZATION)
    finest = run.trials(run.ranks[-1])
    by_place = {(cause, test): trials.causes()[cause] for cause in causes for test, trials in finest.items()}
    found = answers.limits(by_place, requirement)
    amounts = {limit.cause: limit.reduced_to / limit.error for limit in found}

    def suffices_with_less(rank: int) -> bool:
        fractions = []
        for trials in run.trials(rank).values():
            parts = trials.causes()
            errors = wrapped(np.sum([amounts.get(cause, 1.0) * parts[cause] for cause in causes], axis=0))
            fractions.append(requirement.within(errors).sum() / len(trials.numbers))
        return bool(min(fractions) >= requirement.share)

    sufficient = list(itertools.takewhile(suffices_with_less, reversed(run.ranks))) if found else []
    texts = [
        f'{len(trials.succeeded) - trials.succeeded.sum()} of {len(trials.succeeded)} trials of {test} do not come to '
        f'the goal ({trials.failure})'
        for test, trials in finest.items()
        if (~trials.succeeded).mean() > MOST_BY_ONE_CAUSE * (1.0 - requirement.share)
    ]
    answer = Answer(criterion, Kind.NOT_THE_LIMIT, limits=found, given_up=' and '.join(texts))
    if sufficient:
        enough = run.candidates[sufficient[-1]]
        return answer._replace(counts=enough.counts, encoder=enough.label)
    return answer


def _disagreement(run: _Runs, advice: Advice) -> str:
    """Return a note if trials of an encoder, with calibrated wheels, disagree with the sampled drives in a test."""
    if any(curve.draws.robot.calibration for curve in advice.curves.curves):
        return ''
    cells = [(rank, curve) for rank in run.ranks for curve in advice.curves.curves]
    for rank, curve in cells:
        candidate = run.candidates[rank]
        counts = run.trials(rank)[curve.test].counts(Criterion.ODOMETRY, advice.requirement)
        (errors,) = curve.draws.errors([candidate.params], DRAWS, ALL_CAUSES)
        # Avoid a fraction of 1, which would exclude any failure.
        fraction = (int(advice.requirement.within(errors).sum()) + 0.5) / (DRAWS + 1.0)
        p_value = stats.binomtest(counts.within, counts.trials, fraction).pvalue if counts.trials else 1.0
        if p_value < FALSE_ALARM / len(cells):
            return (
                f'but {counts.within} of {counts.trials} trials of {curve.test} with {ppr_text(candidate.label)} are '
                f'within the tolerance, and sampled drives predict {fraction * counts.trials:.1f}'
            )
    return ''


def _tried(run: _Runs, truth: Answer, requirement: Requirement) -> List[TriedEncoder]:
    """Return the trials of each test with each encoder and the budget of the true pose.

    The robot's causes are switched off one by one with the encoder of the answer, and all together with the finest
    encoder, which gives stopping and localization without them.
    """
    ranks = run.ranks
    finest, answered = ranks[-1], run.rank_of(truth.encoder) if truth.encoder else ranks[-1]
    switched = {variant[len(WITHOUT) :]: run.trials(answered, variant) for variant in run.variants[1:-1]}
    sound = run.trials(finest, run.variants[-1])
    tried = []
    for rank in ranks:
        for test, trials in run.trials(rank).items():
            without = {cause: each[test] for cause, each in switched.items()} if rank == answered else {}
            budget, count = truth_budget(trials, run.trials(finest)[test], sound[test], without)
            candidate = run.candidates[rank]
            within = {criterion: trials.counts(criterion, requirement) for criterion in Criterion}
            tried.append(TriedEncoder(test, candidate.label, candidate.counts, within, budget, count))
    return tried


def truth_budget(
    trials: GoalTrials, finest: GoalTrials, sound: GoalTrials, without: Mapping[str, GoalTrials]
) -> Tuple[Optional[Budget], int]:
    """Return the budget of the true pose's error at the goal, and the number of trials it is based on.

    The encoder's part is the difference to trials with the finest one; `sound` are with the finest and without all
    causes, `without` are with the encoder and without one cause each.
    """
    every = [trials, finest, sound, *without.values()]
    numbers = functools.reduce(np.intersect1d, (each.known_numbers for each in every))
    if len(numbers) < FEWEST_FOR_BUDGET:
        return None, len(numbers)
    found, of_finest, *others = (
        wrapped(np.sum(list(each.causes(numbers).values()), axis=0)) for each in (trials, finest, *without.values())
    )
    parts = {cause: answers.part_of(errors) for cause, errors in sound.causes(numbers).items()}
    parts[ENCODER] = answers.added(found, of_finest)
    parts.update({cause: answers.added(found, other) for cause, other in zip(without, others)})
    return Budget(parts, answers.part_of(found)), len(numbers)


def wrapped(errors: np.ndarray) -> np.ndarray:
    """Wrap the yaw of (n, 3) errors to (-pi, pi]."""
    return np.column_stack([errors[:, :2], wrap_angles(errors[:, 2])])
