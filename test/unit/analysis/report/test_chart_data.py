"""The rows that the report's charts draw."""

import pytest

from diff_encoder_sim.analysis.report.chart_data import closed_form_rows, error_rows, spread_rows, trial_rows
from figure_panels import requested_trial
from paper_datasets import IN, cell, dataset, trial
from synthetic_trials import synthetic_dataset

OWN, TRUE = 0, 2  # the odometry's own error and the true pose, among SERIES


def test_a_trial_is_named_by_number_seed_and_bag(tmp_path):
    one = trial('SL', '40', 3, world=IN)._replace(seed=2**60 + 1, bag=tmp_path / 'a.bag')
    assert trial_rows(dataset([one, one._replace(bag=None)])) == [
        {'trial': 0, 'number': 3, 'seed': '1152921504606846977', 'bag': 'a.bag', 'outcome': one.outcome.text},
        {'trial': 1, 'number': 3, 'seed': '1152921504606846977', 'bag': 'none', 'outcome': one.outcome.text},
    ]


def test_a_trial_has_an_error_of_each_series_that_it_has_poses_for():
    made = dataset(
        [trial('SL', '40', 1, world=(0.01, 0.0, 1.0), odom=(0.02, 0.1, 3.0)), trial('SMT', '90', 1, world=IN)]
    )
    rows = error_rows(made)
    assert [(row['trial'], row['setup'], row['encoder']) for row in rows] == [(0, 0, '40')] * 3 + [(1, 1, '90')]
    own = next(row for row in rows if row['source'] == OWN)
    assert (own['x'], own['y'], own['yaw']) == pytest.approx((0.01, 0.1, 2.0))


def test_spreads_have_intervals_and_cells_without_a_spread_are_left_out():
    made = dataset(
        cell('SL', '40', 'world', [IN] * 3),
        cell('SL', '90', 'world', [IN, (0.03, 0.0, 2.0)]),
        cell('SL', 'ideal', 'world', [IN]),
    )
    rows = spread_rows(made)
    assert {row['encoder'] for row in rows} == {'90'} and {row['source'] for row in rows} == {TRUE}
    assert all(0.0 < row['low'] < row['std'] < row['high'] and row['trials'] == 2 for row in rows)
    assert [row['quantity'] for row in rows] == ['x', 'y', 'yaw']


def test_the_closed_form_falls_over_the_range_of_the_encoders():
    made = synthetic_dataset(tests=('SL', 'SMT'), trials=1)._replace(requested={'SL': requested_trial()})
    rows = [row for row in closed_form_rows(made) if row['quantity'] == 'y']
    assert {row['setup'] for row in rows} == {0}
    assert (rows[0]['ppr'], rows[-1]['ppr']) == (40.0, 4096.0)
    assert rows[0]['std'] == pytest.approx(0.321, abs=0.001) and rows[-1]['std'] == pytest.approx(0.0031, abs=0.0001)
    assert sorted((row['std'] for row in rows), reverse=True) == [row['std'] for row in rows]
