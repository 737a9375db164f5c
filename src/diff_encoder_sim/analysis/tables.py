"""Tables 3 to 6: what a pulse is worth, and final pose minus goal of each source.

In the paper's shape, with the mean, which it leaves out, and with 95 % intervals in tables of
their own.
"""

from __future__ import annotations

from collections import Counter
from typing import Dict, List, NamedTuple, Optional, Sequence

import numpy as np

from diff_encoder_sim.analysis.dataset import IDEAL, Cell, Dataset, TrialData, ppr_value
from diff_encoder_sim.analysis.final_errors import count_within, final_errors, with_final_error
from diff_encoder_sim.analysis.path_tables import path_error_table
from diff_encoder_sim.analysis.pulse_resolution import pulse_resolution_table
from diff_encoder_sim.analysis.quantities import QUANTITIES, YAW, Quantity, X
from diff_encoder_sim.analysis.table_files import Column, Entry, Label, Number, Table
from diff_encoder_sim.analysis.table_keys import cell_head, key_columns, key_entries, ppr_head, varied_keys
from diff_encoder_sim.evaluation.sample_statistics import (
    LEVEL,
    bootstrap_std_interval,
    mean_interval,
    spread,
    std_interval,
    wilson,
)
from diff_encoder_sim.recording.topics import TOPIC_OF_SOURCE
from diff_encoder_sim.trials.pose_source import PoseSource
from diff_encoder_sim.trials.trial_outcome import Outcome

BOOTSTRAP_SEED = 0  # equal data, equal intervals

# The paper's tables and their sources; it has none of /amcl_pose.
TABLES = {
    'table4': PoseSource.ODOM,
    'table5': PoseSource.WORLD,
    'table6': PoseSource.GLOBAL,
    'table6_amcl': PoseSource.AMCL,
}
TITLES = {'table4': 'Table 4', 'table5': 'Table 5', 'table6': 'Table 6', 'table6_amcl': 'Like table 6'}

DECIMALS = {'m': 4, 'deg': 3}
PERCENT_DECIMALS = 1


class Statistic(NamedTuple):
    """A row of tables 4 to 6 for each test."""

    label: Label
    decimals: Optional[int]  # None: those of the quantity


STATISTICS = (
    Statistic(Label('min', 'min'), None),
    Statistic(Label('max', 'max'), None),
    Statistic(Label('mean', 'mean'), None),
    Statistic(Label('std', 'std. dev.'), None),
    Statistic(Label('pct_within', '% within'), PERCENT_DECIMALS),
    Statistic(Label('trials', 'trials'), 0),
)


def all_tables(dataset: Dataset) -> List[Table]:
    """Tables 3 to 6 of a dataset, the intervals of 4 to 6, and errors on the way if known."""
    pprs = [value for value in map(ppr_value, dataset.encoders()) if value is not None]
    tables = [pulse_resolution_table(pprs, *dataset.robot)]
    for name in TABLES:
        tables += [goal_table(dataset, name), interval_table(dataset, name)]
    on_the_way = path_error_table(dataset)
    return tables if on_the_way is None else [*tables, on_the_way]


def goal_table(dataset: Dataset, name: str) -> Table:
    """One of tables 4 to 6: rows test and statistic, columns PPR and x, y, yaw.

    Args:
        name: of `TABLES`.
    """
    source, labels, cells = TABLES[name], dataset.encoders(), dataset.cells()
    keys = varied_keys(dataset)
    columns = [*key_columns(keys), Column('statistic', 'statistic')]
    columns += [
        Column(f'{_ppr_name(label)}_{quantity.name}', quantity.head, ppr_head(label))
        for label in labels
        for quantity in QUANTITIES
    ]
    rows: List[List[Entry]] = []
    for test, varied in dict.fromkeys((cell.test, cell.varied) for cell in cells):
        numbers = {label: cell_statistics(cells.get(Cell(test, label, varied), []), source) for label in labels}
        for statistic in STATISTICS:
            rows.append(
                [
                    *key_entries(test, varied, keys),
                    statistic.label,
                    *(
                        _number(numbers[label][quantity], statistic, quantity)
                        for label in labels
                        for quantity in QUANTITIES
                    ),
                ]
            )
    return Table(name, _title(name), columns, rows, _goal_notes(dataset, source))


def cell_statistics(trials: Sequence[TrialData], source: PoseSource) -> Dict[Quantity, Dict[str, Optional[float]]]:
    """Numbers of a cell by quantity and by name of `STATISTICS`; None where there is none.

    In metres, degrees and per cent. The standard deviation is that of a sample (n - 1).
    """
    return {quantity: _statistics(final_errors(trials, source, quantity), quantity) for quantity in QUANTITIES}


def _statistics(values: np.ndarray, quantity: Quantity) -> Dict[str, Optional[float]]:
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


def interval_table(dataset: Dataset, name: str) -> Table:
    """The 95 % intervals of one of `TABLES`: a row for each test, PPR and quantity."""
    source, keys = TABLES[name], varied_keys(dataset)
    columns = [
        *key_columns(keys),
        Column('ppr', 'PPR'),
        Column('quantity', 'error'),
        Column('trials', 'trials'),
        *_columns_with_interval('mean'),
        *_columns_with_interval('std', 'std. dev.'),
        Column('std_bootstrap_low', 'from', 'std. dev., bootstrap'),
        Column('std_bootstrap_high', 'to', 'std. dev., bootstrap'),
        *_columns_with_interval('pct_within', '% within'),
    ]
    rows: List[List[Entry]] = [
        [
            *key_entries(cell.test, cell.varied, keys),
            cell.ppr,
            Label(quantity.name, quantity.head),
            *_estimates(final_errors(trials, source, quantity), quantity),
        ]
        for cell, trials in dataset.cells().items()
        for quantity in QUANTITIES
    ]
    title = f'{_title(name)}: {100 * LEVEL:g} % intervals'
    return Table(
        f'{name}_intervals',
        title,
        columns,
        rows,
        [
            'Mean: by the t-distribution. Standard deviation: by chi-square, which takes errors for '
            'Gaussian, and by the bootstrap, which does not. % within: Wilson. inf: too few trials for '
            'a bound.'
        ],
    )


def _columns_with_interval(name: str, head: str = '') -> List[Column]:
    group = head or name
    return [Column(name, 'value', group), Column(f'{name}_low', 'from', group), Column(f'{name}_high', 'to', group)]


def _estimates(values: np.ndarray, quantity: Quantity) -> List[Entry]:
    """Count, then mean, spread and share within tolerance, each with its interval."""
    numbers, decimals = _statistics(values, quantity), DECIMALS[quantity.unit]
    bootstrap = bootstrap_std_interval(values, LEVEL, np.random.default_rng(BOOTSTRAP_SEED))
    in_unit = [numbers['mean'], *mean_interval(values, LEVEL), numbers['std'], *std_interval(values, LEVEL), *bootstrap]
    shares = [100.0 * bound for bound in wilson(count_within(values, quantity), len(values), LEVEL)]
    return [
        Number(numbers['trials'], 0),
        *(Number(value, decimals) for value in in_unit),
        *(Number(value, PERCENT_DECIMALS) for value in (numbers['pct_within'], *shares)),
    ]


def _ppr_name(label: str) -> str:
    return label if label == IDEAL else f'ppr{label}'


def _number(numbers: Dict[str, Optional[float]], statistic: Statistic, quantity: Quantity) -> Number:
    decimals = DECIMALS[quantity.unit] if statistic.decimals is None else statistic.decimals
    return Number(numbers[statistic.label.name], decimals)


def _title(name: str) -> str:
    return f'{TITLES[name]}. Final {TOPIC_OF_SOURCE[TABLES[name]]} minus the goal'


def _goal_notes(dataset: Dataset, source: PoseSource) -> List[str]:
    """How to read the table, and which trials did not go well or are left out."""
    notes = [
        f"x and y along the map's axes. Within: {X.tolerance:g} m in x and in y, "
        f'{YAW.tolerance:g} degrees in yaw. All trials that ended with a pose count, '
        f'however they ended.'
    ]
    for cell, trials in dataset.cells().items():
        endings = Counter(trial.outcome for trial in trials)
        failed = [
            f'{endings[outcome]} {outcome.text}'
            for outcome in sorted(endings, key=lambda outcome: outcome.value)
            if outcome is not Outcome.SUCCEEDED
        ]
        left_out = len(trials) - len(with_final_error(trials, source))
        if failed or left_out:
            notes.append(
                f'{cell_head(cell)}: {endings[Outcome.SUCCEEDED]} of {len(trials)} '
                f'trials succeeded{_listed(failed)}; {left_out} without a final pose.'
            )
    return notes


def _listed(texts: Sequence[str]) -> str:
    return f' ({", ".join(texts)})' if texts else ''
