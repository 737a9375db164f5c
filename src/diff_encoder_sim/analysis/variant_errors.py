"""The odometry's own final error in each variant of a campaign, beside that in its first variant."""

from __future__ import annotations

import math
from typing import Dict, List, NamedTuple, Optional, Sequence

import numpy as np

from diff_encoder_sim.analysis.dataset import CellKey, Dataset, TrialData, Varied
from diff_encoder_sim.analysis.statistics import PairedResult, wilcoxon
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.trials.trials_csv import VARIANT

# Of the figure, and of the table.
VARIANTS = 'variants'

# Smaller errors are rounding, and have no ratio [m, rad].
LEAST_ERROR = 1e-7


class ErrorKind(NamedTuple):
    """Which part of an error."""

    name: str  # with its unit
    head: str  # as tables and figures show it
    scale: float  # from SI to the shown unit
    decimals: int

    def of(self, error: Pose2D) -> float:
        """Return the size of an error in SI units."""
        return abs(error.yaw_rad) if self is HEADING else math.hypot(error.x_m, error.y_m)


POSITION = ErrorKind('position_mm', 'position [mm]', 1e3, 2)
HEADING = ErrorKind('heading_deg', 'heading [deg]', 180.0 / math.pi, 3)
KINDS = (POSITION, HEADING)


class VariantError(NamedTuple):
    """One kind of error of the trials of a cell, in the unit of its kind."""

    median: float
    low: float  # lower quartile
    high: float  # upper quartile
    ratio: Optional[PairedResult]  # to the first variant, over equal trials; None of the first itself
    failed: int
    trials: int


def variant_errors(dataset: Dataset, kind: ErrorKind) -> Dict[CellKey, VariantError]:
    """Return the errors of all cells that have some; none where the dataset has no variants.

    The error is the final odometry minus the true pose. Trials count whatever their outcome, where they ended.
    """
    cells = dataset.cells()
    if not cells or not all(VARIANT in dict(cell.varied) for cell in cells):
        return {}
    first = first_variant(cells)
    found = {
        cell: _error(kind, trials, cells.get(cell._replace(varied=_in_variant(cell.varied, first))))
        for cell, trials in cells.items()
    }
    return {cell: error for cell, error in found.items() if error is not None}


def first_variant(cells: Dict[CellKey, List[TrialData]]) -> str:
    """Return the name of the variant with which others are compared; '' where there are none."""
    return next((dict(cell.varied).get(VARIANT, '') for cell in cells), '')


def _in_variant(varied: Varied, name: str) -> Varied:
    return tuple((key, name if key == VARIANT else value) for key, value in varied)


def _error(
    kind: ErrorKind, trials: Sequence[TrialData], of_first: Optional[Sequence[TrialData]]
) -> Optional[VariantError]:
    sizes = _sizes(kind, trials)
    if not sizes:
        return None
    low, median, high = kind.scale * np.percentile(list(sizes.values()), (25.0, 50.0, 75.0))
    failed = sum(trial.outcome is not Outcome.SUCCEEDED for trial in trials)
    ratio = None if of_first is None or of_first is trials else _ratio(sizes, _sizes(kind, of_first))
    return VariantError(float(median), float(low), float(high), ratio, failed, len(trials))


def _sizes(kind: ErrorKind, trials: Sequence[TrialData]) -> Dict[int, float]:
    """Return the size of the error by the trial's number."""
    errors = {trial.trial: trial.odometry_minus_truth for trial in trials}
    return {number: kind.of(error) for number, error in errors.items() if error is not None}


def _ratio(sizes: Dict[int, float], of_first: Dict[int, float]) -> Optional[PairedResult]:
    """Compare equal trials: the typical ratio of two errors with its interval, by their logarithms' signed ranks."""
    numbers = [number for number in sizes if number in of_first]
    if not numbers:
        return None
    logs, of_first_logs = (
        np.log([max(of_variant[number], LEAST_ERROR) for number in numbers]) for of_variant in (sizes, of_first)
    )
    result = wilcoxon(logs, of_first_logs)
    low, high = result.interval
    return result._replace(
        estimate=math.exp(result.estimate), interval=result.interval._replace(low=math.exp(low), high=math.exp(high))
    )
