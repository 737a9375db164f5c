"""What is analysed: trials, how each ended, and how far each source of poses was off."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.evaluation.trajectory_error import PathError
from diff_encoder_sim.trials.pose_source import FinalErrors, PoseSource
from diff_encoder_sim.trials.trial_definition import Trial
from diff_encoder_sim.trials.trial_outcome import Outcome

# The paper's tests, first in every table; others follow.
STANDARD_TESTS = ('SL', 'SMT', 'DLD')

# The label of trials whose odometry is the simulator's, without an encoder.
IDEAL = 'ideal'

Varied = Tuple[Tuple[str, str], ...]  # parameters and their values, as a table shows them


class Cell(NamedTuple):
    """What trials have in common that are pooled: all but the seed."""

    test: str
    ppr: str  # encoder.ppr_label, or IDEAL
    varied: Varied


class Tracks(NamedTuple):
    """The way of one trial in the map frame, thinned to what a figure can show."""

    true: np.ndarray  # (n, 2) [m]
    odometry: np.ndarray  # (n, 2) [m]


class TrialData(NamedTuple):
    """One trial."""

    test: str
    ppr: str
    varied: Varied
    trial: int  # equal numbers in other cells drew the same things: they are pairs
    seed: int
    outcome: Outcome
    reason: str  # of any but succeeded
    duration_s: float  # simulated
    distance_m: float  # length of the true path
    errors: FinalErrors
    # By source but the ground truth itself, against it along the path; None where there was nothing
    # to compare. Empty where there is no bag.
    paths: Dict[PoseSource, Optional[PathError]]
    tracks: Optional[Tracks]  # None where there is no bag
    bag: Optional[Path]

    @property
    def cell(self) -> Cell:
        """Where it belongs."""
        return Cell(self.test, self.ppr, self.varied)

    @property
    def odometry_minus_truth(self) -> Optional[Pose2D]:
        """Final /odom minus final /world_pose: what of the error is the odometry's own."""
        odom, world = self.errors.get(PoseSource.ODOM), self.errors.get(PoseSource.WORLD)
        if odom is None or world is None:
            return None
        return Pose2D(odom.x_m - world.x_m, odom.y_m - world.y_m, wrap_angle(odom.yaw_rad - world.yaw_rad))


class RobotGeometry(NamedTuple):
    """What turns pulses into metres, as odometry believes it."""

    wheel_diameter_m: float
    wheel_separation_m: float


class Dataset(NamedTuple):
    """Trials to be analysed together."""

    title: str
    trials: List[TrialData]  # in the order of `cells`, then by number
    notes: List[str]  # what could not be analysed and why, a line each
    manifest: Optional[Dict[str, Any]]  # of a campaign
    folder: Optional[Path]  # of a campaign
    robot: RobotGeometry  # of the first trial, where a campaign varies it
    asked: Dict[str, Trial]  # by test, one trial as it was asked for

    def encoders(self) -> List[str]:
        """Labels of all encoders, ascending."""
        return sorted({trial.ppr for trial in self.trials}, key=ppr_order)

    def cells(self) -> Dict[Cell, List[TrialData]]:
        """Trials by cell: tests in the paper's order, then what is varied, then PPR ascending."""
        pooled: Dict[Cell, List[TrialData]] = {}
        for trial in self.trials:
            pooled.setdefault(trial.cell, []).append(trial)
        tests = [*STANDARD_TESTS, *_in_order(cell.test for cell in pooled)]
        varied = _in_order(cell.varied for cell in pooled)
        return {
            cell: pooled[cell]
            for cell in sorted(
                pooled, key=lambda cell: (tests.index(cell.test), varied.index(cell.varied), ppr_order(cell.ppr))
            )
        }


def ppr_value(label: str) -> Optional[float]:
    """Pulses per revolution of both wheels; None where they differ or there is no encoder."""
    try:
        return float(label)
    except ValueError:
        return None


def ppr_order(label: str) -> Tuple[float, str]:
    """To sort by: ascending, then wheels that differ, then ideal odometry."""
    value = ppr_value(label)
    return (math.inf if value is None else value), label


def _in_order(values: Any) -> List[Any]:
    """Each once, in the order of first appearance."""
    return list(dict.fromkeys(values))
