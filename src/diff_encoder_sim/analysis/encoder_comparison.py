"""Paired comparison of encoders over equal trials, which have the same noise with each encoder."""

from __future__ import annotations

import itertools
import math
from typing import Any, Dict, List, Optional

import numpy as np

from diff_encoder_sim.analysis.encoder_labels import ppr_text
from diff_encoder_sim.analysis.quantities import POSES, QUANTITIES
from diff_encoder_sim.analysis.result_tables import NOTHING, Column, ResultTable
from diff_encoder_sim.analysis.results_table import Results, equal_trials, final_errors
from diff_encoder_sim.analysis.statistics import SIGNIFICANCE, holm, mcnemar, spread_ratio, wilcoxon
from diff_encoder_sim.base.deferred import pandas as pd
from diff_encoder_sim.drives.topics import PoseSource

ROUNDED_TO = 9  # decimals of errors: rounding must not appear as a spread if pulse counts are equal

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
    rows, keys = [], ['test', *results.varied, 'setup']
    for key, of_setup in results.trials.groupby(keys, sort=False):
        pairs = itertools.combinations(of_setup.groupby('ppr', sort=False), 2)
        for ((coarse, first), (fine, second)), source in itertools.product(pairs, PoseSource):
            trials = equal_trials(first, second, source.value)
            for quantity in QUANTITIES if len(trials[0]) else ():
                errors = [np.round(final_errors(one, source.value, quantity), ROUNDED_TO) for one in trials]
                sizes = [np.abs(each) for each in errors]
                found = {
                    SPREAD: spread_ratio(*errors),
                    ERROR: wilcoxon(*sizes),
                    WITHIN: mcnemar(*(each <= quantity.tolerance for each in sizes)),
                }
                for question, (count, estimate, interval, p_value) in found.items():
                    about = (*key, source.value, question, quantity.name, coarse, fine)
                    rows.append((*about, count, estimate, *interval, p_value))
    compared = pd.DataFrame(rows, columns=[*keys, *_RESULTS])
    compared['p_holm'] = compared.groupby(['source', 'question'])['p'].transform(holm)
    compared['verdict'] = [conclusion(row) for row in compared.to_dict('records')]
    return compared


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


def differences(compared: pd.DataFrame) -> pd.DataFrame:
    """Select the significant differences, sorted by test, source and quantity, and add a column `about`."""
    different = compared[compared['p_holm'] < SIGNIFICANCE]
    ordered = compared['setup'].unique(), POSES, _QUANTITIES
    ranks = {name: place for names in ordered for place, name in enumerate(names)}
    different = different.sort_values(['setup', 'source', 'error'], key=lambda column: column.map(ranks), kind='stable')
    about = [f'{POSES[source]}, {_QUANTITIES[error].axis}' for source, error in different[['source', 'error']].values]
    return different.assign(about=about)


def difference_table(different: pd.DataFrame) -> Optional[ResultTable]:
    """Build the table of `differences` by test, source and quantity; None if there are none."""
    if different.empty:
        return None
    rows = [
        {'test': setup, 'about': about, **{question: _worse(of_row, question) for question in QUESTIONS}}
        for (setup, about), of_row in different.groupby(['setup', 'about'], sort=False)
    ]
    columns = {'about': Column('error'), **{question: Column(head) for question, (head, _) in QUESTIONS.items()}}
    return ResultTable('encoders', 'Encoders that differ [counts]', pd.DataFrame(rows), columns)


def _worse(different: pd.DataFrame, question: str) -> str:
    """Return the worse encoders with the better ones."""
    others: Dict[str, List[str]] = {}
    for row in different[different['question'] == question].to_dict('records'):
        is_larger = row['estimate'] > QUESTIONS[question][1]
        labels = row['ppr_a'], row['ppr_b']
        worse, better = labels if is_larger != (question == WITHIN) else labels[::-1]
        others.setdefault(worse, []).append(better)
    return '; '.join(f'{worse} than {", ".join(better)}' for worse, better in others.items()) or NOTHING
