"""The rows that the report's charts draw: trials, their final errors, and the spread of these by encoder."""

from __future__ import annotations

from typing import Any, Dict, Iterator, List, Optional, Tuple

import numpy as np

from diff_encoder_sim.analysis.closed_form import closed_form_std
from diff_encoder_sim.analysis.dataset import CellKey, Dataset, TrialData
from diff_encoder_sim.analysis.encoder_labels import is_real, ppr_text, ppr_value, ppr_values
from diff_encoder_sim.analysis.figures.error_series import SERIES, Series
from diff_encoder_sim.analysis.quantities import LEVEL, QUANTITIES, Quantity
from diff_encoder_sim.analysis.statistics import spread, std_interval

Row = Dict[str, Any]

DECIMALS = 5  # of metres and degrees
DIGITS = 4  # of standard deviations, which range over decades

# Of the closed form's line.
LINE_POINTS = 40


def trial_rows(dataset: Dataset) -> List[Row]:
    """Return a row for each trial, whose `trial` is its place in the dataset."""
    return [
        {
            'trial': index,
            'number': trial.trial,
            'seed': str(trial.seed),  # as a number, a browser would round it
            'bag': trial.bag.name if trial.bag else 'none',
            'outcome': trial.outcome.text,
        }
        for index, trial in enumerate(dataset.trials)
    ]


def error_rows(dataset: Dataset) -> List[Row]:
    """Return a row for each trial and series of `SERIES` that it has: x and y [m], yaw [deg]."""
    setups = dataset.setups()
    rows = []
    for index, trial in enumerate(dataset.trials):
        setup = setups.index((trial.test, trial.varied))
        for place, series in enumerate(SERIES):
            error = _error(trial, series)
            if error is not None:
                rows.append({'trial': index, 'setup': setup, 'encoder': trial.ppr, 'source': place, **error})
    return rows


def _error(trial: TrialData, series: Series) -> Optional[Dict[str, float]]:
    values = {quantity.axis: series.errors([trial], quantity) for quantity in QUANTITIES}
    return {axis: round(float(each[0]), DECIMALS) for axis, each in values.items() if len(each)} or None


def spread_rows(dataset: Dataset) -> List[Row]:
    """Return a row for each cell with a PPR, series and quantity whose errors differ: their standard deviation."""
    rows = []
    for setup, cell, trials in _cells_with_ppr(dataset):
        for place, series in enumerate(SERIES):
            for quantity in QUANTITIES:
                errors = series.errors(trials, quantity)
                std = spread(errors)
                if std:
                    low, high = std_interval(errors, LEVEL)
                    row = {'setup': setup, 'encoder': cell.ppr, 'label': ppr_text(cell.ppr), 'source': place}
                    row.update(quantity=quantity.axis, ppr=ppr_value(cell.ppr), real=is_real(cell.ppr))
                    row.update(std=_rounded(std), low=_rounded(low), high=_rounded(high), trials=len(errors))
                    rows.append(row)
    return rows


def _cells_with_ppr(dataset: Dataset) -> Iterator[Tuple[int, CellKey, List[TrialData]]]:
    setups = dataset.setups()
    for cell, trials in dataset.cells().items():
        if ppr_value(cell.ppr) is not None:
            yield setups.index((cell.test, cell.varied)), cell, trials


def closed_form_rows(dataset: Dataset) -> List[Row]:
    """Return points of the closed form of quantisation over the encoders' range, for each test that has one."""
    pprs = ppr_values(dataset.encoders())
    rows = []
    for setup, (test, _) in enumerate(dataset.setups()):
        if test in dataset.requested and pprs:
            for ppr in np.geomspace(pprs[0], pprs[-1], LINE_POINTS if len(pprs) > 1 else 1):
                stds = closed_form_std(dataset.requested[test], dataset.robot, float(ppr))
                rows += [_closed_form(setup, float(ppr), quantity, stds) for quantity in QUANTITIES]
    return rows


def _closed_form(setup: int, ppr: float, quantity: Quantity, stds: np.ndarray) -> Row:
    std = _rounded(quantity.scale * float(stds[quantity.component]))
    return {'setup': setup, 'quantity': quantity.axis, 'ppr': _rounded(ppr), 'std': std}


def _rounded(number: float) -> float:
    return float(f'{number:.{DIGITS}g}')
