"""The 95 % intervals of tables 4 to 6."""

from __future__ import annotations

from typing import List

import numpy as np

from diff_encoder_sim.analysis.confidence import LEVEL
from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.analysis.final_errors import count_within, final_errors
from diff_encoder_sim.analysis.goal_statistics import DECIMALS, PERCENT_DECIMALS, error_statistics
from diff_encoder_sim.analysis.goal_tables import GoalTable
from diff_encoder_sim.analysis.quantities import QUANTITIES, Quantity
from diff_encoder_sim.analysis.sample_statistics import bootstrap_std_interval, mean_interval, std_interval, wilson
from diff_encoder_sim.analysis.table import Column, Entry, Label, Number, Table
from diff_encoder_sim.analysis.table_keys import key_columns, key_entries, varied_keys

BOOTSTRAP_SEED = 0  # equal data, equal intervals

_NOTE = (
    'Mean: by the t-distribution. Standard deviation: by chi-square, which assumes Gaussian errors, and '
    'by the bootstrap, which does not. % within: Wilson. inf: too few trials for a bound.'
)


def interval_table(dataset: Dataset, kind: GoalTable) -> Table:
    """Build the intervals of one of tables 4 to 6: a row for each test, PPR and quantity."""
    keys = varied_keys(dataset)
    rows: List[List[Entry]] = [
        [
            *key_entries(cell.test, cell.varied, keys),
            cell.ppr,
            Label(quantity.name, quantity.head),
            *_estimates(final_errors(trials, kind.source, quantity), quantity),
        ]
        for cell, trials in kind.cells(dataset).items()
        for quantity in QUANTITIES
    ]
    title = f'{kind.title}: {100 * LEVEL:g} % intervals'
    return Table(f'{kind.name}_intervals', title, [*key_columns(keys), *_columns()], rows, [_NOTE])


def _columns() -> List[Column]:
    return [
        Column('ppr', 'PPR'),
        Column('quantity', 'error'),
        Column('trials', 'trials'),
        *_value_and_interval('mean', 'mean'),
        *_value_and_interval('std', 'std. dev.'),
        Column('std_bootstrap_low', 'from', 'std. dev., bootstrap'),
        Column('std_bootstrap_high', 'to', 'std. dev., bootstrap'),
        *_value_and_interval('pct_within', '% within'),
    ]


def _value_and_interval(name: str, group: str) -> List[Column]:
    return [Column(name, 'value', group), Column(f'{name}_low', 'from', group), Column(f'{name}_high', 'to', group)]


def _estimates(values: np.ndarray, quantity: Quantity) -> List[Entry]:
    """Return the count, then mean, standard deviation and percentage within tolerance, each with its interval."""
    numbers, decimals = error_statistics(values, quantity), DECIMALS[quantity.unit]
    bootstrap = bootstrap_std_interval(values, LEVEL, np.random.default_rng(BOOTSTRAP_SEED))
    in_unit = [numbers['mean'], *mean_interval(values, LEVEL), numbers['std'], *std_interval(values, LEVEL), *bootstrap]
    percentages = [100.0 * bound for bound in wilson(count_within(values, quantity), len(values), LEVEL)]
    return [
        Number(numbers['trials'], 0),
        *(Number(value, decimals) for value in in_unit),
        *(Number(value, PERCENT_DECIMALS) for value in (numbers['pct_within'], *percentages)),
    ]
