"""The table of all comparisons between encoders, those without a difference included."""

from __future__ import annotations

from typing import List, Sequence

from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.analysis.ppr_comparison import PprComparison
from diff_encoder_sim.analysis.ppr_conclusion import conclusion
from diff_encoder_sim.analysis.table import Column, Entry, Number, Table
from diff_encoder_sim.analysis.table_keys import key_columns, key_entries, varied_keys

DECIMALS = 4

_NAMES = ('source', 'question', 'error', 'ppr_a', 'ppr_b', 'pairs', 'estimate', 'low', 'high', 'p_holm', 'verdict')


def comparison_table(dataset: Dataset, compared: Sequence[PprComparison]) -> Table:
    """Build a table with a row for each of the dataset's comparisons.

    The estimate is of a against b: for `spread` the ratio of standard deviations, for `error` the
    difference of absolute errors in the unit of the error, for `within` the difference of the
    fractions within tolerance. `low` and `high` are its 95 % interval, for the comparison alone;
    `p_holm` is corrected for the number of comparisons.
    """
    keys = varied_keys(dataset)
    rows: List[List[Entry]] = [[*key_entries(one.test, one.varied, keys), *_entries(one)] for one in compared]
    columns = [*key_columns(keys), *(Column(name, name) for name in _NAMES)]
    return Table('comparisons', 'Encoders compared', columns, rows, [])


def _entries(one: PprComparison) -> List[Entry]:
    """Return an entry for each of `_NAMES`."""
    result = one.result
    return [
        one.source.value,
        one.question.value,
        one.quantity.name,
        *one.pprs,
        Number(result.pairs, 0),
        *(Number(value, DECIMALS) for value in (result.estimate, *result.interval, one.p_adjusted)),
        conclusion(one),
    ]
