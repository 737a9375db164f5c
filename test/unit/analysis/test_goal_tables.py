"""Tables 4 to 6 and their intervals."""

import math

import pytest

from diff_encoder_sim.analysis.goal_tables import GOAL_TABLES, goal_table, interval_table
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome
from synthetic_trials import DEG, dataset_of, hand_dataset, synthetic_dataset, trial_data
from table_records import column, records

TABLE_4, TABLE_5 = GOAL_TABLES[:2]


def test_table_4_by_hand():
    table = goal_table(hand_dataset(), TABLE_4)
    assert [each.name for each in table.columns] == ['test', 'statistic', 'ppr90_x_m', 'ppr90_y_m', 'ppr90_yaw_deg']
    assert column(table, 'ppr90_x_m') == pytest.approx(
        {'min': -0.06, 'max': 0.03, 'mean': -0.01, 'std': math.sqrt(0.0021), 'pct_within': 200 / 3, 'trials': 3}
    )
    assert column(table, 'ppr90_y_m') == pytest.approx(
        {'min': -0.1, 'max': 0.1, 'mean': 0.0, 'std': 0.1, 'pct_within': 100 / 3, 'trials': 3}
    )
    assert column(table, 'ppr90_yaw_deg') == pytest.approx(
        {'min': -2.0, 'max': 4.0, 'mean': 1.0, 'std': 3.0, 'pct_within': 200 / 3, 'trials': 3}
    )


def test_an_error_as_large_as_the_tolerance_is_within():
    table = goal_table(dataset_of([trial_data(errors=(0.05, -0.05, 3.0 * DEG))]), TABLE_4)
    assert [column(table, f'ppr90_{quantity}')['pct_within'] for quantity in ('x_m', 'y_m')] == [100.0, 100.0]


def test_each_table_has_its_source():
    errors = {
        PoseSource.ODOM: (1.0, 0.0, 0.0),
        PoseSource.WORLD: (2.0, 0.0, 0.0),
        PoseSource.GLOBAL: (3.0, 0.0, 0.0),
        PoseSource.AMCL: (4.0, 0.0, 0.0),
    }
    dataset = dataset_of([trial_data(errors=errors)])
    means = {kind.name: column(goal_table(dataset, kind), 'ppr90_x_m')['mean'] for kind in GOAL_TABLES}
    assert means == {'table4': 1.0, 'table5': 2.0, 'table6': 3.0, 'table6_amcl': 4.0, 'table4_minus_truth': -1.0}


def test_odometry_minus_truth_leaves_out_where_the_robot_stopped():
    errors = {PoseSource.ODOM: (0.3, 0.0, 3.1), PoseSource.WORLD: (0.31, 0.0, -3.1)}
    dataset = dataset_of([trial_data(errors=errors), trial_data(number=2, errors={PoseSource.ODOM: (0.3, 0.0, 3.1)})])
    table = goal_table(dataset, GOAL_TABLES[-1])
    assert table.title == 'As table 4. Final /odom minus /world_pose'
    assert column(table, 'ppr90_x_m')['pct_within'] == 100.0 and column(table, 'ppr90_x_m')['trials'] == 1
    assert column(table, 'ppr90_yaw_deg')['mean'] == pytest.approx(math.degrees(6.2 - 2.0 * math.pi))
    [x_row, *_] = records(interval_table(dataset, GOAL_TABLES[-1]))
    assert (x_row['trials'], float(x_row['mean'])) == ('1', pytest.approx(-0.01))


def test_rows_are_by_test_and_columns_by_ppr_in_the_papers_order():
    dataset = synthetic_dataset(
        tests=('DLD', 'SL', 'SMT'), trials=2, pprs=('4096', '40', '1024', '90', 'ideal', '90-1024')
    )
    table = goal_table(dataset, TABLE_4)
    assert list(dict.fromkeys(row[0] for row in table.rows)) == ['SL', 'SMT', 'DLD']
    assert list(dict.fromkeys(each.group for each in table.columns if each.group)) == [
        '40 PPR',
        '90 PPR',
        '1024 PPR',
        '4096 PPR',
        '90-1024 PPR',
        'ideal odometry',
    ]


def test_a_cell_without_trials_is_empty():
    table = goal_table(dataset_of([trial_data('SL', '40'), trial_data('SMT', '90')]), TABLE_4)
    row = next(each for each in records(table) if each['test'] == 'SL' and each['statistic'] == 'mean')
    assert (row['ppr40_x_m'], row['ppr90_x_m']) == ('0.0', '')


def test_failed_trials_count_as_they_ended_and_torn_ones_do_not():
    trials = [
        trial_data(number=1, errors=(0.0, 0.0, 0.0)),
        trial_data(number=2, errors=(9.0, 0.0, 0.0), outcome=Outcome.COLLISION),
        trial_data(number=3, errors=(5.0, 0.0, 0.0), outcome=Outcome.TORN),
        trial_data(number=4, errors={PoseSource.ODOM: None}, outcome=Outcome.ABORTED),
    ]
    table = goal_table(dataset_of(trials), TABLE_4)
    numbers = column(table, 'ppr90_x_m')
    assert (numbers['max'], numbers['pct_within'], numbers['trials']) == (9.0, 50.0, 2.0)
    assert table.notes[1:] == [
        'SL, 90 PPR: 1 of 4 trials succeeded (1 aborted, 1 collision, 1 torn); 2 without a final pose.'
    ]


TABLE_4, TABLE_5 = GOAL_TABLES[:2]


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
