"""The trials to be analysed: how each ended, and the error of each pose source."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Dict, Iterable, List, NamedTuple, Optional, Tuple, TypeVar

import numpy as np

from diff_encoder_sim.analysis.encoder_labels import ppr_order
from diff_encoder_sim.analysis.results_table import STANDARD_TESTS, Results, RobotGeometry
from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trajectory_error import PathError
from diff_encoder_sim.drives.trial_definition import FinalErrors, Outcome, Trial
from diff_encoder_sim.trials.trials_csv import TrialRow

__all__ = ['STANDARD_TESTS', 'CellKey', 'Dataset', 'RobotGeometry', 'Tracks', 'TrialData', 'distinct']
Varied = Tuple[Tuple[str, str], ...]  # parameters and their values, as a table shows them

_Value = TypeVar('_Value')


class CellKey(NamedTuple):
    """Identifies the trials that are pooled: those that differ by seed alone."""

    test: str
    ppr: str  # encoder label
    varied: Varied


class Tracks(NamedTuple):
    """The path of one trial in the map frame, thinned to what a figure can show."""

    true: np.ndarray  # (n, 2) [m]
    odometry: np.ndarray  # (n, 2) [m]


class TrialData(NamedTuple):
    """One trial."""

    test: str
    ppr: str  # encoder label
    varied: Varied
    trial: int  # equal numbers in other cells have equal random draws: they are pairs
    seed: int
    outcome: Outcome
    reason: str  # of a failure
    duration_s: float  # simulated
    distance_m: float  # length of the true path
    errors: FinalErrors
    # By source but ground truth, against ground truth along the path; None where there was nothing
    # to compare. Empty where there is no bag.
    paths: Dict[PoseSource, Optional[PathError]]
    tracks: Optional[Tracks]  # None where there is no bag
    bag: Optional[Path]

    @property
    def cell(self) -> CellKey:
        """Return the cell that the trial belongs to."""
        return CellKey(self.test, self.ppr, self.varied)

    @property
    def odometry_minus_truth(self) -> Optional[Pose2D]:
        """Return the final odometry pose minus the final true pose: the odometry's own error."""
        odom, world = self.errors.get(PoseSource.ODOM), self.errors.get(PoseSource.WORLD)
        if odom is None or world is None:
            return None
        return Pose2D(odom.x_m - world.x_m, odom.y_m - world.y_m, wrap_angle(odom.yaw_rad - world.yaw_rad))


class Dataset(NamedTuple):
    """Trials to be analysed together."""

    title: str
    trials: List[TrialData]  # in the order of `cells`, then by number
    notes: List[str]  # what could not be analysed and why, a line each
    manifest: Optional[Dict[str, Any]]  # of a campaign
    folder: Optional[Path]  # of a campaign
    robot: RobotGeometry  # of the first trial, where a campaign varies it
    requested: Dict[str, Trial]  # the definition of one trial of each test

    def encoders(self) -> List[str]:
        """Return the labels of all encoders, ascending."""
        return sorted({trial.ppr for trial in self.trials}, key=ppr_order)

    def cells(self) -> Dict[CellKey, List[TrialData]]:
        """Group the trials by cell: the standard tests first, then by varied parameters, then PPR ascending."""
        by_key: Dict[Tuple[str, str, Varied], List[TrialData]] = {}
        for trial in self.trials:
            by_key.setdefault((trial.test, trial.ppr, trial.varied), []).append(trial)
        pooled = {CellKey(*key): trials for key, trials in by_key.items()}
        tests = [*STANDARD_TESTS, *distinct(cell.test for cell in pooled)]
        varied = distinct(cell.varied for cell in pooled)

        def order(cell: CellKey) -> Tuple[int, int, Tuple[float, str]]:
            return tests.index(cell.test), varied.index(cell.varied), ppr_order(cell.ppr)

        return {cell: pooled[cell] for cell in sorted(pooled, key=order)}

    def setups(self) -> List[Tuple[str, Varied]]:
        """Return the distinct pairs of test and varied parameters, in the order of `cells`."""
        return distinct((cell.test, cell.varied) for cell in self.cells())


def distinct(values: Iterable[_Value]) -> List[_Value]:
    """Return each value once, in the order of first appearance."""
    return list(dict.fromkeys(values))


def dataset_of(results: Results) -> Dataset:
    """Return the same as a dataset."""
    trials = [
        TrialData(
            row['test'],
            row['ppr'],
            tuple((key, row[key]) for key in results.varied),
            row['trial'],
            row['seed'],
            Outcome(row['outcome']),
            row['reason'],
            row['duration_s'],
            row['distance_m'],
            {
                source: None
                if np.isnan(row[f'{source.value}_x_m'])
                else Pose2D(*(row[f'{source.value}_{part}'] for part in ('x_m', 'y_m', 'yaw_rad')))
                for source in PoseSource
            },
            {},
            None if row['true_path'] is None else Tracks(row['true_path'], row['odom_path']),
            Path(row['bag']) if row['bag'] else None,
        )
        for _, row in results.trials.iterrows()
    ]
    return Dataset(
        results.title, trials, results.notes, results.manifest or None, results.folder, results.robot, results.requested
    )


def data_of(row: TrialRow) -> TrialData:
    """Convert a line of trials.csv; without its bag nothing is known about the path."""
    return TrialData(*row[:8], row.distance_m, row.errors, {}, None, None)
