"""Paired comparison of encoders over equal trials, which have the same noise with each encoder."""

from __future__ import annotations

import itertools
import math
from typing import Any, Dict, Iterator, List, Optional, Tuple

import numpy as np

from diff_encoder_sim.analysis.encoder_labels import ppr_text
from diff_encoder_sim.analysis.quantities import POSES, QUANTITIES, Quantity
from diff_encoder_sim.analysis.result_tables import NOTHING, ResultTable
from diff_encoder_sim.analysis.results_table import Results, equal_trials, final_errors
from diff_encoder_sim.analysis.statistics import SIGNIFICANCE, PairedResult, holm, mcnemar, spread_ratio, wilcoxon
from diff_encoder_sim.analysis.tables import setup_columns
from diff_encoder_sim.base.deferred import pandas as pd
from diff_encoder_sim.drives.topics import PoseSource

# Decimals of errors: rounding must not appear as a spread if pulse counts are equal.
ROUNDED_TO = 9

# Compared properties: text about the worse encoder, and the estimate for equal encoders.
SPREAD, ERROR, WITHIN = 'spread', 'error', 'within'
QUESTIONS = {
    SPREAD: ('spreads more', 1.0),  # standard deviation: the estimate is a ratio
    ERROR: ('has larger errors', 0.0),  # absolute value: a difference
    WITHIN: ('is within tolerance less often', 0.0),  # fraction within tolerance: a difference
}

_QUANTITIES = {quantity.name: quantity for quantity in QUANTITIES}
_RESULTS = ['source', 'question', 'error', 'ppr_a', 'ppr_b', 'pairs', 'estimate', 'low', 'high', 'p']


def compare_encoders(results: Results) -> pd.DataFrame:
    """Compare each pair of PPRs with equal test and parameters by all `QUESTIONS`, for each source and quantity.

    Trials without a final pose in one of the two are left out.

    Returns:
        a row per comparison: `test`, varied parameters, `source`, `question`, `error` (the quantity), `ppr_a` and
        `ppr_b` (the coarser first), number of `pairs`; `estimate` of a against b: for `spread` the ratio of standard
        deviations, for `error` the difference of absolute errors in the unit of the error, for `within` the difference
        of the fractions within tolerance; `low` and `high`, its uncorrected 95 % interval; `p`; `p_holm`, corrected
        over the comparisons of equal source and question; the `verdict`; and the `setup`.
    """
    rows = []
    for setup, of_setup in results.trials.groupby('setup', sort=False):
        keys = setup_columns(results, of_setup.iloc[0])
        pairs = itertools.combinations(of_setup.groupby('ppr', sort=False), 2)
        for ((coarse, first), (fine, second)), source in itertools.product(pairs, PoseSource):
            for quantity in QUANTITIES:
                for question, found in _results(first, second, source.value, quantity):
                    named = (source.value, question, quantity.name, coarse, fine)
                    values = (*named, found.pairs, found.estimate, *found.interval, found.p_value)
                    rows.append({**keys, **dict(zip(_RESULTS, values)), 'setup': setup})
    compared = pd.DataFrame(rows, columns=['test', *results.varied, *_RESULTS, 'setup'])
    compared['p_holm'] = compared.groupby(['source', 'question'])['p'].transform(holm)
    compared['verdict'] = [conclusion(row) for row in compared.to_dict('records')]
    return compared


def _results(
    first: pd.DataFrame, second: pd.DataFrame, source: str, quantity: Quantity
) -> Iterator[Tuple[str, PairedResult]]:
    pairs = equal_trials(first, second, source)
    if len(pairs[0]):
        errors_a, errors_b = (np.round(final_errors(trials, source, quantity), ROUNDED_TO) for trials in pairs)
        sizes_a, sizes_b = np.abs(errors_a), np.abs(errors_b)
        yield SPREAD, spread_ratio(errors_a, errors_b)
        yield ERROR, wilcoxon(sizes_a, sizes_b)
        yield WITHIN, mcnemar(sizes_a <= quantity.tolerance, sizes_b <= quantity.tolerance)


def conclusion(row: Dict[str, Any]) -> str:
    """Return the result of a row of `compare_encoders` as a sentence without full stop."""
    first, second = ppr_text(row['ppr_a']), ppr_text(row['ppr_b'])
    question, estimate, low, high = row['question'], row['estimate'], row['low'], row['high']
    if row['p_holm'] >= SIGNIFICANCE:
        return f'{first} and {second} are not distinguishable with {row["pairs"]} trials'
    quantity, equal = _QUANTITIES[row['error']], QUESTIONS[question][1]
    if estimate < equal:  # the second against the first
        first, second = second, first
        estimate, high, low = (
            (math.inf if value <= 0.0 else 1.0 / value) if question == SPREAD else -value
            for value in (estimate, low, high)
        )
    if question == SPREAD and math.isinf(estimate):
        return f'{first} spreads, {second} does not: all its {row["pairs"]} errors are equal'
    if question == SPREAD:
        return f'{first} spreads more than {second} (ratio {estimate:.3g}, 95 % interval {low:.3g} to {high:.3g})'
    if question == ERROR:
        by = f'{estimate:.2g} {quantity.unit}, 95 % interval {low:.2g} to {high:.2g}'
        return f'{first} has larger errors than {second} (by {by})'
    points = f'{100.0 * estimate:.0f} percentage points, 95 % interval {100.0 * low:.0f} to {100.0 * high:.0f}'
    return f'{first} is within {quantity.tolerance:g} {quantity.unit} more often than {second} (by {points})'


def comparison_table(compared: pd.DataFrame) -> ResultTable:
    """Build the table of all comparisons."""
    return ResultTable('comparisons', 'Encoders compared', compared.drop(columns=['p', 'setup']))


def differences(compared: pd.DataFrame) -> pd.DataFrame:
    """Select the significant differences, sorted by test, source and quantity, and add a column `about`."""
    different, columns = compared[compared['p_holm'] < SIGNIFICANCE], ['setup', 'source', 'error']
    ranks = (list(compared['setup'].unique()), list(POSES), list(_QUANTITIES))
    rank = {name: {value: place for place, value in enumerate(values)} for name, values in zip(columns, ranks)}
    different = different.sort_values(columns, key=lambda column: column.map(rank[column.name]), kind='stable')
    about = [
        f'{POSES[source]}, {_QUANTITIES[error].axis}' for source, error in zip(different['source'], different['error'])
    ]
    return different.assign(about=about)


def difference_table(compared: pd.DataFrame) -> Optional[ResultTable]:
    """Build the table of differences by test, source and quantity; None if there are none."""
    different = differences(compared)
    if different.empty:
        return None
    rows = [
        {'test': setup, 'about': about, **{question: _worse(of_row, question) for question in QUESTIONS}}
        for (setup, about), of_row in different.groupby(['setup', 'about'], sort=False)
    ]
    note = (
        f'Example: 40 PPR spreads more than 1024 and 4096 PPR. Listed if p is below {SIGNIFICANCE:g} after '
        f"Holm's correction over all comparisons of a source in a column. In all other of the {len(compared)} "
        f'comparisons the encoders are not distinguishable with these trials.'
    )
    heads = {'about': ('', 'error'), **{question: ('', head) for question, (head, _) in QUESTIONS.items()}}
    return ResultTable('encoders', 'Encoders that differ [PPR]', pd.DataFrame(rows), heads, {}, [note])


def _worse(different: pd.DataFrame, question: str) -> str:
    """Return the worse encoders with the better ones."""
    others: Dict[str, List[str]] = {}
    for row in different[different['question'] == question].to_dict('records'):
        is_larger = row['estimate'] > QUESTIONS[question][1]
        labels = row['ppr_a'], row['ppr_b']
        worse, better = labels if is_larger != (question == WITHIN) else labels[::-1]
        others.setdefault(worse, []).append(better)
    return '; '.join(f'{worse} than {", ".join(better)}' for worse, better in others.items()) or NOTHING


def difference_texts(compared: pd.DataFrame) -> Dict[str, List[str]]:
    """Return a sentence per difference, by test."""
    return {
        setup: [f'{about}: {verdict}.' for about, verdict in zip(of_setup['about'], of_setup['verdict'])]
        for setup, of_setup in differences(compared).groupby('setup', sort=False)
    }
