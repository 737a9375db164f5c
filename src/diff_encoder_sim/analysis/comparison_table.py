"""The table of all comparisons between encoders, those that show no difference included."""
from __future__ import annotations

from typing import List

from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.analysis.ppr_comparison import PprComparison, compare_pprs
from diff_encoder_sim.analysis.table_files import Column, Entry, Number, Table
from diff_encoder_sim.analysis.table_keys import varied_keys, varied_values

DECIMALS = 4

_COLUMNS = [Column(name, name) for name in (
    'source', 'question', 'error', 'ppr_a', 'ppr_b', 'pairs', 'estimate', 'low', 'high', 'p_holm',
    'verdict')]


def comparison_table(dataset: Dataset) -> Table:
    """A row for each comparison of `compare_pprs`.

    The estimate is of a against b: for `spread` the ratio of standard deviations, for `error` the
    difference of absolute errors in the unit of the error, for `within` the difference of shares
    within tolerance. `low` and `high` are its 95 % interval, for the comparison alone; `p_holm` is
    corrected for the number of comparisons.
    """
    keys = varied_keys(dataset)
    columns = [Column('test', 'test'), *(Column(key, key) for key in keys), *_COLUMNS]
    rows: List[List[Entry]] = [[one.test, *varied_values(one.varied, keys), *_entries(one)]
                               for one in compare_pprs(dataset)]
    return Table('comparisons', 'Encoders compared', columns, rows, [])


def _entries(one: PprComparison) -> List[Entry]:
    """An entry for each of `_COLUMNS`."""
    result = one.result
    return [one.source, one.question.value, one.quantity.name, *one.pprs, Number(result.pairs, 0),
            *(Number(value, DECIMALS) for value in (result.estimate, *result.interval,
                                                    one.p_adjusted)), one.verdict]
