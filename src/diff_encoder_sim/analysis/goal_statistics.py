"""Statistics of the final errors of a cell, as tables 4 to 6 show them."""

from __future__ import annotations

from typing import Dict, NamedTuple, Optional, Sequence

import numpy as np

from diff_encoder_sim.analysis.dataset import TrialData
from diff_encoder_sim.analysis.final_errors import count_within, final_errors
from diff_encoder_sim.analysis.quantities import QUANTITIES, Quantity
from diff_encoder_sim.analysis.sample_statistics import spread
from diff_encoder_sim.analysis.table import Label
from diff_encoder_sim.drives.topics import PoseSource

DECIMALS = {'m': 4, 'deg': 3}
PERCENT_DECIMALS = 1


class Statistic(NamedTuple):
    """A row of tables 4 to 6 for each test."""

    label: Label
    decimals: Optional[int]  # None: those of the quantity's unit


STATISTICS = (
    Statistic(Label('min', 'min'), None),
    Statistic(Label('max', 'max'), None),
    Statistic(Label('mean', 'mean'), None),
    Statistic(Label('std', 'std. dev.'), None),
    Statistic(Label('pct_within', '% within'), PERCENT_DECIMALS),
    Statistic(Label('trials', 'trials'), 0),
)

Statistics = Dict[str, Optional[float]]  # by name of STATISTICS; None where there is no such number


def cell_statistics(trials: Sequence[TrialData], source: PoseSource) -> Dict[Quantity, Statistics]:
    """Compute the statistics of a cell by quantity, in metres, degrees and per cent."""
    return {quantity: error_statistics(final_errors(trials, source, quantity), quantity) for quantity in QUANTITIES}


def error_statistics(values: np.ndarray, quantity: Quantity) -> Statistics:
    """Compute the statistics of final errors; the standard deviation is that of a sample (n - 1)."""
    if not len(values):
        return {**dict.fromkeys(statistic.label.name for statistic in STATISTICS), 'trials': 0}
    return {
        'min': float(values.min()),
        'max': float(values.max()),
        'mean': float(values.mean()),
        'std': spread(values),
        'pct_within': 100.0 * count_within(values, quantity) / len(values),
        'trials': len(values),
    }
