#!/usr/bin/env python3
"""Odometry and pose estimate minus truth, as the paper's tables 4 to 6 imply them: bias, spread, range.

The tables are of final poses minus the goal, which hold how the robot stops, and print no means."""

from __future__ import annotations

import argparse
import math
from collections import defaultdict
from typing import Dict, List, NamedTuple, Sequence, Tuple

import numpy as np
from checkout import print_header
from implied_means import MeanEstimator
from scipy import stats
from tabulate import tabulate

from diff_encoder_sim.analysis.paper.paper_cells import PPRS, TRIALS, errata_of, load_paper_cells
from diff_encoder_sim.analysis.quantities import QUANTITIES, YAW, Quantity
from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE, PoseSource

TESTS = ('SL', 'SMT', 'DLD')
ODOM, ESTIMATE, TRUTH = PoseSource.ODOM, PoseSource.GLOBAL, PoseSource.WORLD
FINE_PPRS = ('1024', '4096')  # whose pulses are too short to matter
SETS = 100_000

Statistics = Dict[str, float]  # by the names of paper_cells.STATISTICS


class Offset(NamedTuple):
    """A mean in the paper's unit."""

    value: float
    half: float  # of its 95 % interval

    def __str__(self) -> str:
        """With its interval."""
        return f'{self.value:+.3f} ± {self.half:.3f}'


class PaperColumns:
    """The paper's numbers but for its errata, and what they imply."""

    def __init__(self) -> None:
        self._printed: Dict[Tuple[PoseSource, str, str, Quantity], Statistics] = defaultdict(dict)
        for cell in load_paper_cells():
            if not errata_of(cell):
                self._printed[cell.source, cell.test, cell.ppr, cell.quantity][cell.statistic] = cell.value
        self._estimator = MeanEstimator()

    def statistics(self, source: PoseSource, test: str, ppr: str, quantity: Quantity) -> Statistics:
        """Return a column's numbers."""
        return self._printed[source, test, ppr, quantity]

    def mean(self, source: PoseSource, test: str, ppr: str, quantity: Quantity) -> Offset:
        """Return the mean behind a column; nan where it is not known."""
        printed = self.statistics(source, test, ppr, quantity)
        implied = self._estimator.estimate(printed, quantity.tolerance) if len(printed) == 4 else None
        return Offset(implied.value, 0.5 * (implied.high - implied.low)) if implied else Offset(math.nan, math.nan)

    def minus_truth(self, source: PoseSource, test: str, ppr: str, quantity: Quantity) -> Offset:
        """Return the difference of means; its interval is too wide, as it takes the columns for different trials'."""
        ours, truth = (self.mean(one, test, ppr, quantity) for one in (source, TRUTH))
        return Offset(ours.value - truth.value, math.hypot(ours.half, truth.half))

    def pooled(self, test: str, quantity: Quantity) -> Offset:
        """Return odometry minus truth of the fine encoders together, each weighted by its interval."""
        offsets = [self.minus_truth(ODOM, test, ppr, quantity) for ppr in FINE_PPRS]
        known = [offset for offset in offsets if not math.isnan(offset.value)]
        weights = np.array([offset.half**-2.0 for offset in known])
        return Offset(float(weights @ [offset.value for offset in known] / weights.sum()), float(weights.sum() ** -0.5))

    def excess_spread(self, test: str, ppr: str, quantity: Quantity) -> np.ndarray:
        """Return what odometry spreads beyond truth: median and 95 % of what the two standard deviations allow."""
        odometry, truth = (self.statistics(source, test, ppr, quantity)['std'] for source in (ODOM, TRUTH))
        chi2 = stats.chi2(TRIALS - 1).rvs((2, SETS), random_state=0) / (TRIALS - 1)
        excess = np.sqrt(np.maximum(odometry**2 / chi2[0] - truth**2 / chi2[1], 0.0))
        return np.quantile(excess, (0.5, 0.025, 0.975))


def bias_table(paper: PaperColumns) -> str:
    """Means minus truth, and how the extremes of yaw differ, as those of equal trials do."""
    rows = [
        [
            TOPIC_OF_SOURCE[source],
            test,
            ppr,
            *(paper.minus_truth(source, test, ppr, quantity) for quantity in QUANTITIES),
            *(_difference(paper, source, test, ppr, extreme) for extreme in ('min', 'max')),
        ]
        for source in (ODOM, ESTIMATE)
        for test in TESTS
        for ppr in PPRS
    ]
    return table(rows, ['', 'test', 'PPR', *(one.head for one in QUANTITIES), 'yaw: min - min', 'max - max'])


def _difference(paper: PaperColumns, source: PoseSource, test: str, ppr: str, extreme: str) -> str:
    both = [paper.statistics(one, test, ppr, YAW).get(extreme, math.nan) for one in (source, TRUTH)]
    return f'{both[0] - both[1]:+.2f}'


def spread_table(paper: PaperColumns) -> str:
    """What odometry spreads beyond truth; and its range in standard deviations, with its chance in Gaussian trials."""
    chances = standardised_ranges(np.random.default_rng(0).standard_normal((SETS, TRIALS)))
    rows: List[List[object]] = []
    for test in TESTS:
        for ppr in FINE_PPRS:
            for quantity in QUANTITIES:
                printed = paper.statistics(ODOM, test, ppr, quantity)
                if printed['std'] == 0.0 or not paper.statistics(TRUTH, test, ppr, quantity):
                    continue
                excess, reach = paper.excess_spread(test, ppr, quantity), reach_of(printed)
                rows.append(
                    [test, ppr, quantity.head, '{:.3f} ({:.3f} to {:.3f})'.format(*excess), f'{reach:.2f}']
                    + [f'{np.mean(chances >= reach):.4f}']
                )
    return table(rows, ['test', 'PPR', 'of', 'odometry beyond truth', 'range / std dev', 'chance of it'])


def reach_of(printed: Statistics) -> float:
    """Return maximum minus minimum in standard deviations."""
    return (printed['max'] - printed['min']) / printed['std']


def standardised_ranges(values: np.ndarray) -> np.ndarray:
    """Return the same of (..., trials) values."""
    return np.asarray(np.ptp(values, axis=-1) / values.std(axis=-1, ddof=1))


def table(rows: Sequence[Sequence[object]], heads: Sequence[str]) -> str:
    """Lay out texts."""
    return str(tabulate([[str(one) for one in row] for row in rows], heads, disable_numparse=True, stralign='right'))


def main() -> None:
    """Print what the paper's tables imply."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    print_header('Odometry and pose estimate minus truth by the tables of the paper: mean ± 95 %; nan: errata')
    paper = PaperColumns()
    print(bias_table(paper), spread_table(paper), sep='\n\n')


if __name__ == '__main__':
    main()
