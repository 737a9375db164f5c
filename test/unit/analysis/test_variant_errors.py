"""What each variant of a campaign costs, against its first one."""

import math

import pytest

from diff_encoder_sim.analysis.dataset import CellKey
from diff_encoder_sim.analysis.variant_errors import HEADING, POSITION, variant_errors
from diff_encoder_sim.drives.trial_definition import Outcome
from paper_datasets import dataset, trial

NONE, MISSED = (('variant', 'none'),), (('variant', 'missed 1 %'),)
WORLD = (1.0, 2.0, 3.0)


def cell(varied, sizes_m, **others):
    """Trials whose odometry is off by these distances, and by as many degrees."""
    return [
        trial('SL', '40', number, varied=varied, world=WORLD, odom=(1.0 + size, 2.0, 3.0 + size), **others)
        for number, size in enumerate(sizes_m, start=1)
    ]


def test_the_error_is_the_odometrys_own_with_its_quartiles():
    found = variant_errors(dataset(cell(NONE, [0.1, 0.2, 0.3, 0.4, 0.5])), POSITION)
    [(key, error)] = found.items()
    assert key == CellKey('SL', '40', NONE)
    assert (error.median, error.low, error.high) == pytest.approx((300.0, 200.0, 400.0))
    assert (error.ratio, error.failed, error.trials) == (None, 0, 5)
    heading = variant_errors(dataset(cell(NONE, [0.1, 0.2, 0.3])), HEADING)[key]
    assert heading.median == pytest.approx(0.2)


def test_the_ratio_is_of_equal_trials():
    sizes = [0.1, 0.02, 0.3, 0.04, 0.5, 0.06, 0.7, 0.08]
    trials = dataset(cell(NONE, sizes), cell(MISSED, [3.0 * size for size in sizes])[1:])
    ratio = variant_errors(trials, POSITION)[CellKey('SL', '40', MISSED)].ratio
    assert (ratio.pairs, ratio.estimate) == (7, pytest.approx(3.0))
    assert tuple(ratio.interval) == pytest.approx((3.0, 3.0))


def test_few_trials_have_a_ratio_and_no_interval():
    trials = dataset(cell(NONE, [0.1, 0.1]), cell(MISSED, [0.2, 0.8]))
    ratio = variant_errors(trials, POSITION)[CellKey('SL', '40', MISSED)].ratio
    assert ratio.estimate == pytest.approx(4.0) and tuple(ratio.interval) == (0.0, math.inf)


def test_trials_that_failed_count_and_are_counted():
    lost = cell(MISSED, [5.0], outcome=Outcome.LOST)
    error = variant_errors(dataset(cell(NONE, [0.1]), lost), POSITION)[CellKey('SL', '40', MISSED)]
    assert (error.median, error.failed, error.trials) == (pytest.approx(5000.0), 1, 1)
