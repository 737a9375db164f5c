"""The paper's numbers, errata and claims from config/paper, and the significance of its differences from ours."""

from __future__ import annotations

import math
from typing import Dict, NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.analysis.quantities import QUANTITIES, Quantity
from diff_encoder_sim.analysis.results_table import Results, RobotGeometry, final_errors
from diff_encoder_sim.analysis.statistics import SIGNIFICANCE, Interval, holm, spread, std_interval, wilson
from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.deferred import pandas as pd
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.drives.test_definition import load_test
from diff_encoder_sim.drives.trial_definition import Trial

stats = deferred('scipy.stats')

TRIALS = 30  # per cell
PPRS = ('40', '90', '1024', '4096')
STATISTICS = ('min', 'max', 'std', 'pct_within')

# Table 3 as printed, by PPR: travel per pulse (that at 90 PPR is an erratum), and rotation per pulse of both wheels in
# opposite directions.
PRINTED_RESOLUTIONS: Dict[str, Dict[float, float]] = {
    'linear_mm': {40: 15.7, 90: 7.98, 1024: 0.61, 4096: 0.15},
    'two_wheel_angle_deg': {40: 4.5, 90: 2.0, 1024: 0.18, 4096: 0.045},
}

CALIBRATED = {'table': '4', 'test': 'SL', 'ppr': '4096', 'quantity': 'y_m'}  # cells; docs/adr/0012-calibration.md

WHEELS = RobotGeometry(0.2, 0.4)  # of ALTO (section 3 of the paper)
RELATIVE = 0.01  # tolerance for calibrated wheels

ROUNDING = 1e-9  # tolerance for equal values
FEWEST_FOR_KURTOSIS = 4  # for an unbiased estimate of the excess
TAIL_FRACTION = 0.25  # of our values estimates the tail
HALF_A_DIGIT = 0.0005  # of the last digit printed in the paper, in metres and degrees

COLUMNS = ['campaign', 'table', 'source', 'test', 'ppr', 'quantity', 'statistic', 'paper', 'ours', 'low', 'high', 'p']


def load_paper_cells() -> pd.DataFrame:
    """Load the numbers of tables 4 to 6, in the file's order.

    Returns:
        `table`, `source` (of quantities.POSES), `test`, `ppr` (encoder label), `quantity`, `statistic` (of STATISTICS),
        `paper`: the number in m, deg or per cent; `left_out`: reasons to exclude it: keys of errata, and `calibrated`
        if it was used for calibration.
    """
    cells = paper_table('tables_4_5_6').rename(columns={'value': 'paper'}).assign(left_out='')
    # An erratum without statistics or quantities affects all of them.
    columns = {'tables': 'table', 'statistics': 'statistic', 'quantities': 'quantity'}
    rules = paper_table('errata').rename(columns=columns).to_dict('records')
    for rule in [*(rule for rule in rules if rule['table']), {'key': 'calibrated', **CALIBRATED}]:
        names = [name for name in ('table', 'test', 'ppr', 'statistic', 'quantity') if rule.get(name)]
        is_affected = np.all([cells[name].isin(rule[name].split()) for name in names], axis=0)
        cells.loc[is_affected, 'left_out'] += f' {rule["key"]}'
    cells['left_out'] = cells['left_out'].str.strip()
    return cells.assign(source=cells['source'].str.replace('_pose', '')).astype({'table': int, 'paper': float})


def paper_table(name: str) -> pd.DataFrame:
    """Load texts from config/paper: `errata` with the cells that they affect, or the paraphrased `claims`."""
    return pd.read_csv(package_folder() / 'config' / 'paper' / f'{name}.csv', dtype=str, keep_default_na=False)


def of_paper(results: Results) -> Results:
    """Return only the trials with the robot and the tests of the paper.

    The robot is compared by its wheels; a test by its definition, navigated only.
    """
    is_alto = np.allclose(results.robot, WHEELS, RELATIVE, 0.0)
    tests = {test for test, requested in results.requested.items() if is_alto and _is_of_paper(requested)}
    return results._replace(trials=results.trials[results.trials['test'].isin(tests)])


def _is_of_paper(requested: Trial) -> bool:
    try:
        own = load_test(requested.test.name, package_folder() / 'config')
    except ConfigError:  # a test that the package does not have
        return False
    return requested.nav != 'scripted' and requested.test == own


def spread_p_value(values: np.ndarray, reported: float, count: int) -> float:
    """Test a reported standard deviation of `count` values by the F-test, corrected for heavy tails.

    Box (Biometrika 40, 1953): with excess kurtosis g, the variance of the log variance is 1 + g / 2 times that of a
    Gaussian, so both degrees of freedom are divided by this factor. Light tails are treated as Gaussian. Requires at
    least two values.
    """
    ours, freedom, excess = spread(values) or 0.0, np.array([len(values) - 1, count - 1]), 0.0
    if ours == reported or min(ours, reported) == 0.0:
        return float(ours == reported)
    ratio = (ours / reported) ** 2
    if len(values) >= FEWEST_FOR_KURTOSIS:
        excess = max(0.0, float(stats.kurtosis(values, bias=False)))
    degrees = freedom / (1.0 + 0.5 * excess)
    return min(1.0, 2.0 * float(min(stats.f.cdf(ratio, *degrees), stats.f.sf(ratio, *degrees))))


def maximum_p_value(values: np.ndarray, reported: Interval, count: int) -> Optional[float]:
    """Test a reported maximum of `count` values, two-sided; None if inconclusive.

    The number of our values above it has a distribution-free probability (`_chances_of_above`). Beyond our maximum the
    tail is assumed exponential (`_chance_beyond`), which is conservative for Gaussian and uniform tails. Of the numbers
    in the interval `reported`, which round to the printed one, the nearest is tested.
    """
    fewest, most = (int(np.count_nonzero(values > bound)) for bound in (reported.high, reported.low))
    chances, descending = _chances_of_above(len(values), count), np.sort(values)[::-1]
    tail, steps = _tail(len(values)), -np.diff(descending)
    if most:
        too_high = 1.0 - float(chances[most + 1])
    elif tail == 0 or descending[0] - descending[tail] < ROUNDING:
        return None
    else:  # the scale is at least the smallest step, because whole pulses make values multiples of a step
        scale = max(np.mean(descending[:tail]) - descending[tail], np.min(steps[steps > ROUNDING]))
        beyond = max(0.0, (reported.low - descending[0]) / scale)
        too_high = _chance_beyond(float(beyond), len(values), count)
    return min(1.0, 2.0 * min(float(chances[fewest]), too_high))


def _tail(values: int) -> int:
    return min(math.ceil(TAIL_FRACTION * values), values - 1)


def _chances_of_above(ours: int, theirs: int) -> np.ndarray:
    """Return (ours + 2,) probabilities that at least 0, 1, 2, ... of ours exceed the maximum of theirs."""
    ranks = np.arange(ours + 1)
    return np.cumprod(np.concatenate([[1.0], (ours - ranks) / (ours + theirs - ranks)]))


def _chance_beyond(beyond: float, ours: int, theirs: int) -> float:
    """Return the probability that the maximum of theirs exceeds ours by `beyond` estimated scales of the tail.

    In an exponential tail the i-th spacing from the top is exponential with mean 1/i (Renyi), all are independent, and
    the scale is the mean of i times the first `tail` of them. The mean of exp(-j M), with M our maximum plus `beyond`
    scales, is therefore a product; the binomial sum over j is the probability that theirs lie below M.
    """
    ranks, tail, total = np.arange(1, ours + 1), _tail(ours), 0.0
    in_tail = np.where(ranks <= tail, beyond / tail, 0.0)
    for j in range(1, theirs + 1):
        means = 1.0 / (1.0 + j / ranks + j * in_tail)
        total -= math.comb(theirs, j) * (-1.0) ** j * float(np.prod(means))
    return total


class Agreement(NamedTuple):
    """One statistic of ours and its agreement with that of the paper."""

    ours: float
    interval: Tuple[float, float]  # 95 %; NaN for min and max
    p_value: Optional[float]  # two-sided; None if inconclusive


def agreement(statistic: str, values: np.ndarray, printed: float, quantity: Quantity) -> Optional[Agreement]:
    """Compare a statistic of ours with the paper's; None without enough values.

    Tests: standard deviation by the F-test, corrected for heavy tails; per cent within tolerance by Fisher's exact
    test; minimum and maximum by `maximum_p_value`. Of all numbers that round to the printed one, the nearest is tested.
    """
    if len(values) < (2 if statistic == 'std' else 1):
        return None
    if statistic == 'std':
        ours = spread(values) or 0.0
        theirs = float(np.clip(ours, max(0.0, printed - HALF_A_DIGIT), printed + HALF_A_DIGIT))
        return Agreement(ours, std_interval(values), spread_p_value(values, theirs, TRIALS))
    if statistic == 'pct_within':
        within, trials = int(np.sum(np.abs(values) <= quantity.tolerance)), len(values)
        theirs_within = round(printed / 100.0 * TRIALS)
        counts = np.array([[within, trials - within], [theirs_within, TRIALS - theirs_within]])
        interval = Interval(*(100.0 * bound for bound in wilson(within, trials)))
        return Agreement(100.0 * within / trials, interval, float(stats.fisher_exact(counts)[1]))
    sign = -1.0 if statistic == 'min' else 1.0  # the minimum is a maximum with the signs reversed
    values, printed = sign * values, sign * printed
    p_value = maximum_p_value(values, Interval(printed - HALF_A_DIGIT, printed + HALF_A_DIGIT), TRIALS)
    return Agreement(sign * float(values.max()), (math.nan, math.nan), p_value)


def compare_with_paper(trials: pd.DataFrame) -> pd.DataFrame:
    """Compare the numbers of the paper with those of trials with a column `campaign`, for their tests and PPRs.

    Returns:
        a row per number: `campaign`, `table`, `source`, `test`, `ppr`, `quantity`, `statistic`; the `paper`'s number,
        `ours` with its interval `low` to `high`; `p`, NaN if inconclusive; `p_holm`, corrected over the evidence of
        equal campaign, source and test; `left_out`: reasons to exclude the number; number of our `trials`.
    """
    quantities = {quantity.name: quantity for quantity in QUANTITIES}
    printed, rows = load_paper_cells(), []
    for campaign, of_campaign in trials.groupby('campaign', sort=False):
        for (test, ppr, _), of_cell in of_campaign.groupby(['test', 'ppr', 'cell'], sort=False):
            for paper in printed[(printed['test'] == test) & (printed['ppr'] == ppr)].to_dict('records'):
                quantity = quantities[paper['quantity']]
                values = final_errors(of_cell, paper['source'], quantity)
                found = agreement(paper['statistic'], values, paper['paper'], quantity)
                if found is not None:
                    ours = dict(zip(('ours', 'low', 'high', 'p'), (found.ours, *found.interval, found.p_value)))
                    rows.append({'campaign': campaign, **paper, **ours, 'trials': len(values)})
    compared = pd.DataFrame(rows, columns=[*COLUMNS, 'left_out', 'trials']).astype({'p': float})
    families = compared[is_evidence(compared)].groupby(['campaign', 'source', 'test'])['p']
    return compared.assign(p_holm=families.transform(holm))


def is_evidence(compared: pd.DataFrame) -> pd.Series:
    """Return which numbers are evidence: without errata, not used for calibration, and testable."""
    return (compared['left_out'] == '') & compared['p'].notna()


def score(compared: pd.DataFrame) -> Tuple[int, int]:
    """Count the numbers that are evidence, and those that are not contradicted: significant after Holm's correction."""
    evidence = is_evidence(compared)
    return int(evidence.sum()), int((evidence & ~(compared['p_holm'] < SIGNIFICANCE)).sum())
