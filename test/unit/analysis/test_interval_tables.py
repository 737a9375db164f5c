"""The intervals of tables 4 to 6, by hand."""

import math

import pytest

from diff_encoder_sim.analysis.goal_tables import GOAL_TABLES, goal_table, interval_table
from synthetic_trials import dataset_of, hand_dataset, synthetic_dataset, trial_data
from table_records import column, records

TABLE_4, TABLE_5 = GOAL_TABLES[:2]


def test_one_trial_has_no_spread_and_unbounded_intervals():
    dataset = dataset_of([trial_data(errors=(0.01, 0.0, 0.0))])
    assert column(goal_table(dataset, TABLE_4), 'ppr90_x_m')['std'] is None
    x_row = records(interval_table(dataset, TABLE_4))[0]
    assert (x_row['trials'], x_row['std'], x_row['mean_high']) == ('1', '', 'inf')


def test_intervals_hold_their_value():
    for row in records(interval_table(synthetic_dataset(trials=30), TABLE_5)):
        for name in ('mean', 'std', 'pct_within'):
            assert float(row[f'{name}_low']) <= float(row[name]) <= float(row[f'{name}_high'])
        assert float(row['std_bootstrap_low']) < float(row['std']) < float(row['std_bootstrap_high'])


def test_intervals_by_hand():
    row = records(interval_table(hand_dataset(), TABLE_4))[0]
    # t of 2 degrees of freedom: 4.3027; chi-square of 2 at 2.5 and 97.5 %: 0.050636 and 7.377759.
    half = 4.302653 * math.sqrt(0.0021 / 3)
    assert [float(row[name]) for name in ('mean_low', 'mean_high')] == pytest.approx([-0.01 - half, -0.01 + half])
    assert [float(row[name]) for name in ('std_low', 'std_high')] == pytest.approx(
        [math.sqrt(0.0042 / 7.377759), math.sqrt(0.0042 / 0.0506356)], rel=1e-5
    )
