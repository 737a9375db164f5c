"""Final pose errors of several trials as arrays, and how many are within tolerance."""

from __future__ import annotations

from typing import List, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.analysis.dataset import TrialData
from diff_encoder_sim.analysis.quantities import QUANTITIES, Quantity
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome


def final_error(trial: TrialData, source: PoseSource) -> Optional[Pose2D]:
    """Return the final pose minus the goal; None without a pose, and for a torn bag, whose final pose is unknown."""
    return _final_errors([trial], source)[0]


def with_final_error(trials: Sequence[TrialData], source: PoseSource) -> List[TrialData]:
    """Return the trials that have a final error, whatever their outcome, as the paper pools them."""
    return [trial for trial, error in zip(trials, _final_errors(trials, source)) if error is not None]


def minus_truth(trials: Sequence[TrialData]) -> List[TrialData]:
    """Return the trials with the odometry minus the true pose, its own error, in place of the odometry minus the goal.

    The latter holds how far from the goal the robot stopped.
    """
    return [trial._replace(errors={**trial.errors, PoseSource.ODOM: trial.odometry_minus_truth}) for trial in trials]


def equal_trials(
    first: Sequence[TrialData], second: Sequence[TrialData], source: PoseSource
) -> Tuple[List[TrialData], List[TrialData]]:
    """Return the trials of equal number of two cells that both have a final error, in the same order."""
    of_first, of_second = (
        {trial.trial: trial for trial in with_final_error(trials, source)} for trials in (first, second)
    )
    numbers = [number for number in of_first if number in of_second]
    return [of_first[number] for number in numbers], [of_second[number] for number in numbers]


def final_errors(trials: Sequence[TrialData], source: PoseSource, quantity: Quantity) -> np.ndarray:
    """(n,) final pose minus goal of the trials that have one, in the quantity's unit."""
    component, errors = quantity.component, _final_errors(trials, source)
    return quantity.scale * np.array([error[component] for error in errors if error is not None])


def count_within(values: np.ndarray, quantity: Quantity) -> int:
    """Count the errors within the quantity's tolerance."""
    return int(np.count_nonzero(np.abs(values) <= quantity.tolerance))


def count_within_all(
    trials: Sequence[TrialData], source: PoseSource, quantities: Sequence[Quantity] = QUANTITIES
) -> int:
    """Count the trials that are within the tolerances of all quantities at once."""
    within = [np.abs(final_errors(trials, source, quantity)) <= quantity.tolerance for quantity in quantities]
    return int(np.count_nonzero(np.all(within, axis=0)))


def _final_errors(trials: Sequence[TrialData], source: PoseSource) -> List[Optional[Pose2D]]:
    return [None if trial.outcome is Outcome.TORN else trial.errors.get(source) for trial in trials]


def odometry_minus_truth(trials: Sequence[TrialData], quantity: Quantity) -> np.ndarray:
    """(n,) final odometry minus true pose of the trials that have both, in the quantity's unit."""
    errors = [trial.odometry_minus_truth for trial in trials]
    return quantity.scale * np.array([error[quantity.component] for error in errors if error is not None])
