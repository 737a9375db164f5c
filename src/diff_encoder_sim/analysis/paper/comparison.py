"""Compares each number of the paper with ours: can the difference be chance? And how many numbers agree."""

from __future__ import annotations

import functools
import math
from typing import NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.analysis.paper.paper_cells import TRIALS, load_paper_cells
from diff_encoder_sim.analysis.quantities import LEVEL, QUANTITIES, Quantity
from diff_encoder_sim.analysis.results_table import Results, final_errors, varied_texts
from diff_encoder_sim.analysis.statistics import SIGNIFICANCE, Interval, holm, spread, std_interval, wilson
from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.deferred import pandas as pd

optimize = deferred('scipy.optimize')
stats = deferred('scipy.stats')

# Values that differ by less are equal but for rounding.
ROUNDING = 1e-9

# The excess of the kurtosis has an unbiased estimate from so many values on.
FEWEST_FOR_KURTOSIS = 4

# How far the largest values reach is judged by the largest of ours.
TAIL_FRACTION = 0.25


def spread_p_value(values: np.ndarray, reported: float, count: int) -> float:
    """Test a reported standard deviation of `count` values by the F-test, careful where our tails are heavy.

    Box (Biometrika 40, 1953): with the excess kurtosis g the logarithm of a variance is 1 + g / 2 times as
    uncertain as a Gaussian's, so that both degrees of freedom are divided by it. Light tails are taken as
    Gaussian. Of at least two values.
    """
    ours, freedom = spread(values) or 0.0, np.array([len(values) - 1, count - 1])
    if ours == reported:
        return 1.0
    if min(ours, reported) == 0.0:
        return 0.0
    ratio = (ours / reported) ** 2
    excess = 0.0
    if len(values) >= FEWEST_FOR_KURTOSIS and ours:
        excess = max(0.0, float(stats.kurtosis(values, bias=False)))
    degrees = freedom / (1.0 + 0.5 * excess)
    return min(1.0, 2.0 * float(min(stats.f.cdf(ratio, *degrees), stats.f.sf(ratio, *degrees))))


def maximum_p_value(values: np.ndarray, reported: Interval, count: int) -> Optional[float]:
    """Test a reported maximum of `count` values, on both sides; None where nothing can be concluded.

    How many of ours lie above it has a known chance, whatever the distribution (`_chances_of_above`). Beyond all
    of ours, that chance says no more: there the tail is taken as exponential (`_chance_beyond`), which Gaussian
    and uniform tails do not reach, so that for them false alarms are rarer.

    Args:
        values: ours; at least one.
        reported: the numbers that round to the reported one; the nearest counts.
        count: of the values behind it.
    """
    fewest, most = (int(np.count_nonzero(values > bound)) for bound in (reported.high, reported.low))
    chances = _chances_of_above(len(values), count)
    too_low = float(chances[fewest])
    if most:
        too_high = 1.0 - float(chances[most + 1])
    else:
        scale = _tail_scale(values)
        if scale is None:
            return None
        beyond = max(0.0, (reported.low - float(values.max())) / scale)
        too_high = _chance_beyond(beyond, len(values), count)
    return min(1.0, 2.0 * min(too_low, too_high))


def maximum_interval(values: np.ndarray, count: int, level: float) -> Interval:
    """Compute where the maximum of `count` fresh values lies: all that `maximum_p_value` does not reject.

    An infinite bound is none: there are too few values for it, or they are all equal.
    """
    descending, tail = np.sort(values)[::-1], 0.5 - 0.5 * level
    chances = _chances_of_above(len(values), count)
    likely = int(np.count_nonzero(chances[:-1] >= tail))
    low = float(descending[likely - 1]) if likely <= len(values) else -math.inf
    unlikely = int(np.count_nonzero(1.0 - chances[1 : likely + 1] < tail))
    if unlikely:
        return Interval(low, float(descending[unlikely - 1]))
    scale = _tail_scale(values)
    if scale is None:
        return Interval(low, math.inf)
    return Interval(low, float(descending[0]) + scale * _furthest(len(values), count, tail))


@functools.lru_cache(maxsize=8)
def _chances_of_above(ours: int, theirs: int) -> np.ndarray:
    """(ours + 2,) chances that at least 0, 1, 2, ... of ours exceed the maximum of theirs, all orders equally likely.

    From 1 for none, to 0 for one more than there are.
    """
    ranks = np.arange(ours + 1)
    chances = np.cumprod(np.concatenate([[1.0], (ours - ranks) / (ours + theirs - ranks)]))
    chances.setflags(write=False)  # all callers have the same
    return chances


def _tail_scale(values: np.ndarray) -> Optional[float]:
    """Estimate by how much the values of the tail exceed the next one in the mean; None where they are all equal.

    Whole pulses make values that are multiples of a step: no tail falls off within less than that.
    """
    descending, tail = np.sort(values)[::-1], _in_tail(len(values))
    if tail == 0 or descending[0] - descending[tail] < ROUNDING:
        return None
    steps = -np.diff(descending)
    return float(max(np.mean(descending[:tail]) - descending[tail], np.min(steps[steps > ROUNDING])))


def _in_tail(count: int) -> int:
    """Return how many of the largest of our values are the tail: a quarter of them."""
    return min(math.ceil(TAIL_FRACTION * count), count - 1)


@functools.lru_cache(maxsize=4096)
def _chance_beyond(beyond: float, ours: int, theirs: int) -> float:
    """Return the chance that the maximum of theirs exceeds ours by `beyond` estimated scales of the tail.

    Of an exponential tail, the i-th spacing from the top is exponential with mean 1/i (Renyi), all are independent,
    and the scale is the mean of i times the first `tail` of them. So the mean of exp(-j M), M the place of our
    maximum plus `beyond` scales, is a product; the binomial sum over j is the chance that theirs lie below M.
    """
    ranks, tail, total = np.arange(1, ours + 1), _in_tail(ours), 0.0
    in_tail = np.where(ranks <= tail, beyond / tail, 0.0)
    for j in range(1, theirs + 1):
        means = 1.0 / (1.0 + j / ranks + j * in_tail)
        total -= math.comb(theirs, j) * (-1.0) ** j * float(np.prod(means))
    return total


@functools.lru_cache(maxsize=256)
def _furthest(ours: int, theirs: int, chance: float) -> float:
    """Return how many scales beyond ours the maximum of theirs lies with this chance."""
    high = 1.0
    while _chance_beyond(high, ours, theirs) > chance:
        high *= 2.0
    return float(optimize.brentq(lambda beyond: _chance_beyond(beyond, ours, theirs) - chance, 0.0, high))


# Half of the last digit that the paper prints, of metres and of degrees alike.
HALF_A_DIGIT = 0.0005


class Agreement(NamedTuple):
    """One statistic of ours, and how it agrees with the paper's."""

    ours: float
    interval: Interval  # 95 %: of the statistic; of min and max, where those of the paper's number of trials lie
    p_value: Optional[float]  # two-sided; None if nothing can be concluded


def agreement(statistic: str, values: np.ndarray, printed: float, quantity: Quantity) -> Optional[Agreement]:
    """Compare a statistic of ours with the paper's; None without enough values.

    The standard deviation by the F-test, careful where our tails are heavy; per cent within tolerance by Fisher's exact
    test; minimum and maximum with where those of as many trials as the paper's would lie. A printed number stands for
    all numbers that round to it: the nearest counts.
    """
    if len(values) < (2 if statistic == 'std' else 1):
        return None
    if statistic == 'std':
        ours = spread(values) or 0.0
        theirs = float(np.clip(ours, max(0.0, printed - HALF_A_DIGIT), printed + HALF_A_DIGIT))
        return Agreement(ours, std_interval(values, LEVEL), spread_p_value(values, theirs, TRIALS))
    if statistic == 'pct_within':
        within, trials, theirs_within = (
            int(np.sum(np.abs(values) <= quantity.tolerance)),
            len(values),
            round(printed / 100.0 * TRIALS),
        )
        interval = Interval(*(100.0 * bound for bound in wilson(within, trials, LEVEL)))
        counts = np.array([[within, trials - within], [theirs_within, TRIALS - theirs_within]])
        return Agreement(100.0 * within / trials, interval, float(stats.fisher_exact(counts)[1]))
    if statistic == 'min':  # with the signs reversed
        ours, (low, high), p_value = agreement('max', -values, -printed, quantity) or (0.0, (0.0, 0.0), None)
        return Agreement(-ours, Interval(-high, -low), p_value)
    p_value = maximum_p_value(values, Interval(printed - HALF_A_DIGIT, printed + HALF_A_DIGIT), TRIALS)
    return Agreement(float(values.max()), maximum_interval(values, TRIALS, LEVEL), p_value)


def compare_with_paper(results: Results, name: str = '') -> pd.DataFrame:
    """Compare each number of the paper with ours, if the results have its test and PPR.

    Args:
        results: the trials.
        name: of these results, among others.

    Returns:
        a row for each number: `campaign`, the name with the varied parameters; `table`, `source`, `test`, `ppr`,
        `quantity`, `statistic`; the `paper`'s number, `ours` with its interval `low` to `high`; `p`, NaN if nothing can
        be concluded; `p_holm`, corrected over the numbers of equal campaign, source and test, of those that are
        evidence; `left_out`: why it is no evidence; number of our `trials`.
    """
    quantities = {quantity.name: quantity for quantity in QUANTITIES}
    printed, rows = load_paper_cells().to_dict('records'), []
    for _, of_cell in results.trials.groupby('cell', sort=False):
        first = of_cell.iloc[0]
        campaign = ', '.join(filter(None, [name, *varied_texts(first[results.varied], results.varied)]))
        for paper in printed:
            if (paper['test'], paper['ppr']) == (first['test'], first['ppr']):
                quantity = quantities[paper['quantity']]
                values = final_errors(of_cell, paper['source'], quantity)
                found = agreement(paper['statistic'], values, paper['paper'], quantity)
                if found is not None:
                    ours = dict(zip(('ours', 'low', 'high', 'p'), (found.ours, *found.interval, found.p_value)))
                    rows.append({'campaign': campaign, **paper, **ours, 'trials': len(values)})
    names = ['campaign', 'table', 'source', 'test', 'ppr', 'quantity', 'statistic', 'paper', 'ours', 'low', 'high', 'p']
    compared = pd.DataFrame(rows, columns=[*names, 'left_out', 'trials']).astype({'p': float})
    by_campaign = np.argsort(pd.factorize(compared['campaign'])[0], kind='stable')
    compared = compared.iloc[by_campaign].reset_index(drop=True)
    families = compared[is_evidence(compared)].groupby(['campaign', 'source', 'test'])['p']
    return compared.assign(p_holm=families.transform(holm))


def is_evidence(compared: pd.DataFrame) -> pd.Series:
    """Return which numbers speak for or against: sound ones of the paper, not fitted to, that can be tested."""
    return (compared['left_out'] == '') & compared['p'].notna()


def is_contradicted(compared: pd.DataFrame) -> pd.Series:
    """Return of which numbers chance does not explain the difference, corrected for their family."""
    return compared['p_holm'] < SIGNIFICANCE


def score(compared: pd.DataFrame) -> Tuple[int, int]:
    """Count the numbers that are evidence, and those of them that agree: that are not contradicted."""
    evidence = is_evidence(compared)
    return int(evidence.sum()), int((evidence & ~is_contradicted(compared)).sum())
