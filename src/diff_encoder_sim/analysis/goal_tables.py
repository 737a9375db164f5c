"""Tables 4 to 6 in the paper's shape, with means, and their 95 % intervals."""

from __future__ import annotations

from collections import Counter
from typing import Dict, Iterator, List, NamedTuple, Optional, Sequence

import numpy as np

from diff_encoder_sim.analysis.dataset import CellKey, Dataset, TrialData
from diff_encoder_sim.analysis.encoder_labels import IDEAL, ppr_text
from diff_encoder_sim.analysis.final_errors import count_within, final_errors, minus_truth, with_final_error
from diff_encoder_sim.analysis.quantities import LEVEL, QUANTITIES, YAW, Quantity, X
from diff_encoder_sim.analysis.statistics import bootstrap_std_interval, mean_interval, spread, std_interval, wilson
from diff_encoder_sim.analysis.table import Column, Entry, Label, Number, Table
from diff_encoder_sim.analysis.table_keys import cell_text, key_columns, key_entries, varied_keys
from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE, PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome

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


class GoalTable(NamedTuple):
    """One of the paper's tables 4 to 6, or one in their shape."""

    name: str  # of its files
    number: str  # in its title
    source: PoseSource
    is_minus_truth: bool = False  # rather than minus the goal

    @property
    def title(self) -> str:
        """Return the caption."""
        subtracted = TOPIC_OF_SOURCE[PoseSource.WORLD] if self.is_minus_truth else 'the goal'
        return f'{self.number}. Final {TOPIC_OF_SOURCE[self.source]} minus {subtracted}'

    def cells(self, dataset: Dataset) -> Dict[CellKey, List[TrialData]]:
        """Return the dataset's cells with the errors that the table is about."""
        cells = dataset.cells()
        return {key: minus_truth(trials) for key, trials in cells.items()} if self.is_minus_truth else cells


# The paper has no table of /amcl_pose, and none of the odometry's own error.
GOAL_TABLES = (
    GoalTable('table4', 'Table 4', PoseSource.ODOM),
    GoalTable('table5', 'Table 5', PoseSource.WORLD),
    GoalTable('table6', 'Table 6', PoseSource.GLOBAL),
    GoalTable('table6_amcl', 'As table 6', PoseSource.AMCL),
    GoalTable('table4_minus_truth', 'As table 4', PoseSource.ODOM, is_minus_truth=True),
)


def goal_table(dataset: Dataset, kind: GoalTable) -> Table:
    """Build one of tables 4 to 6: rows test and statistic, columns PPR and x, y, yaw."""
    labels, cells, keys = dataset.encoders(), kind.cells(dataset), varied_keys(dataset)
    rows: List[List[Entry]] = []
    for test, varied in dataset.setups():
        numbers = [cell_statistics(cells.get(CellKey(test, label, varied), []), kind.source) for label in labels]
        rows += [
            [
                *key_entries(test, varied, keys),
                statistic.label,
                *(_number(of_cell[quantity], statistic, quantity) for of_cell in numbers for quantity in QUANTITIES),
            ]
            for statistic in STATISTICS
        ]
    columns = [*key_columns(keys), Column('statistic', 'statistic'), *_columns(labels)]
    return Table(kind.name, kind.title, columns, rows, _notes(cells, kind.source))


def _columns(labels: Sequence[str]) -> Iterator[Column]:
    for label in labels:
        name = label if label == IDEAL else f'ppr{label}'.replace(' ', '_')
        for quantity in QUANTITIES:
            yield Column(f'{name}_{quantity.name}', quantity.head, ppr_text(label))


def _number(numbers: Statistics, statistic: Statistic, quantity: Quantity) -> Number:
    decimals = DECIMALS[quantity.unit] if statistic.decimals is None else statistic.decimals
    return Number(numbers[statistic.label.name], decimals)


def _notes(cells: Dict[CellKey, List[TrialData]], source: PoseSource) -> List[str]:
    """Explain the table, and list the cells with failed trials or without a final pose."""
    tolerances = f'{X.tolerance:g} m in x and in y, {YAW.tolerance:g} degrees in yaw'
    counted = 'All trials that ended with a pose count, whatever their outcome.'
    notes = [f"x and y along the map's axes. Within: {tolerances}. {counted}"]
    for cell, trials in cells.items():
        left_out = len(trials) - len(with_final_error(trials, source))
        if left_out or any(trial.outcome is not Outcome.SUCCEEDED for trial in trials):
            notes.append(f'{cell_text(cell)}: {_outcomes(trials)}; {left_out} without a final pose.')
    return notes


def _outcomes(trials: Sequence[TrialData]) -> str:
    counts = Counter(trial.outcome for trial in trials)
    succeeded = f'{counts.pop(Outcome.SUCCEEDED, 0)} of {len(trials)} trials succeeded'
    failed = ', '.join(f'{counts[outcome]} {outcome.text}' for outcome in sorted(counts, key=lambda one: one.value))
    return f'{succeeded} ({failed})' if failed else succeeded


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
    return Table(f'{kind.name}_intervals', title, [*key_columns(keys), *_columns_interval_tables()], rows, [_NOTE])


def _columns_interval_tables() -> List[Column]:
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
