"""Tables 4 to 6 in the paper's shape: the final pose minus the goal by pose source.

They have the mean, which the paper leaves out; 95 % intervals are in tables of their own.
"""

from __future__ import annotations

from collections import Counter
from typing import Dict, Iterator, List, NamedTuple, Sequence

from diff_encoder_sim.analysis.dataset import CellKey, Dataset, TrialData
from diff_encoder_sim.analysis.encoder_labels import IDEAL, ppr_text
from diff_encoder_sim.analysis.final_errors import minus_truth, with_final_error
from diff_encoder_sim.analysis.goal_statistics import DECIMALS, STATISTICS, Statistic, Statistics, cell_statistics
from diff_encoder_sim.analysis.quantities import QUANTITIES, YAW, Quantity, X
from diff_encoder_sim.analysis.table import Column, Entry, Number, Table
from diff_encoder_sim.analysis.table_keys import cell_text, key_columns, key_entries, varied_keys
from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE, PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome


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
