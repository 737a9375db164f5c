"""How closed-loop trials end: stopping, localization and odometry, each with its error."""

from __future__ import annotations

import functools
from typing import Dict, List, Mapping, NamedTuple, Sequence

import numpy as np

from diff_encoder_sim.advice.answers import Criterion
from diff_encoder_sim.advice.budget import Budget, added, part_of
from diff_encoder_sim.advice.requirement import Requirement, along_goal
from diff_encoder_sim.analysis.dataset import TrialData
from diff_encoder_sim.base.se2 import Pose2D, wrap_angles
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome

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
