"""Tables 3 to 6: numbers worked out by hand, their shape, and what each format makes of them."""

import csv
import io
import math

import numpy as np
import pytest

from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.analysis.goal_tables import GOAL_TABLES, goal_table
from diff_encoder_sim.analysis.interval_tables import interval_table
from diff_encoder_sim.analysis.pulse_resolution import pulse_resolution_table
from diff_encoder_sim.analysis.table_files import (
    Column,
    Label,
    Number,
    Table,
    csv_text,
    latex_text,
    markdown_text,
    write_tables,
)
from diff_encoder_sim.analysis.tables import all_tables
from diff_encoder_sim.trials.pose_source import PoseSource
from diff_encoder_sim.trials.trial_outcome import Outcome
from synthetic_trials import dataset_of, synthetic_dataset, trial_data

TABLE_4, TABLE_5 = GOAL_TABLES[:2]
DEG = math.pi / 180.0
# x [m], y [m], yaw: of three trials; within 0.05 m: 2 and 1 of them; within 3 degrees: 2.
HAND_ERRORS = [(0.00, 0.10, 1.0 * DEG), (0.03, -0.10, -2.0 * DEG), (-0.06, 0.00, 4.0 * DEG)]


def hand_dataset(**other) -> Dataset:
    return dataset_of(trial_data('SL', '90', number, errors, **other) for number, errors in enumerate(HAND_ERRORS, 1))


def records(table):
    """Its CSV file, read back."""
    return list(csv.DictReader(io.StringIO(csv_text(table))))


def column(table, name, key='statistic'):
    return {row[key]: float(row[name]) if row[name] else None for row in records(table)}


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
    assert means == {'table4': 1.0, 'table5': 2.0, 'table6': 3.0, 'table6_amcl': 4.0}


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


def test_what_is_varied_has_rows_of_its_own():
    variants = ((('config.counter_modulus', '0'),), (('config.counter_modulus', '65536'),))
    table = goal_table(synthetic_dataset(tests=('SL',), pprs=('90',), trials=3, variants=variants), TABLE_4)
    assert [(row['config.counter_modulus'], row['statistic']) for row in records(table)][::6] == [
        ('0', 'min'),
        ('65536', 'min'),
    ]


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


def test_no_note_where_all_succeeded():
    assert len(goal_table(hand_dataset(), TABLE_4).notes) == 1


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


def test_table_3_of_alto():
    rows = records(pulse_resolution_table([40.0, 90.0, 1024.0, 4096.0], 0.2, 0.4))
    assert [round(float(row['linear_mm']), 2) for row in rows] == [15.71, 6.98, 0.61, 0.15]
    assert [float(row['two_wheel_angle_deg']) for row in rows] == pytest.approx([4.5, 2.0, 0.17578125, 0.0439453125])
    assert [float(row['one_wheel_angle_deg']) for row in rows] == pytest.approx([2.25, 1.0, 0.087890625, 0.02197265625])


def test_table_3_leaves_encoders_without_one_ppr_out():
    tables = {table.name: table for table in all_tables(synthetic_dataset(pprs=('90', 'ideal', '90-1024'), trials=1))}
    assert [row[0] for row in tables['table3'].rows] == ['90']


def written(folder, *tables, csv_only=()):
    """Contents of the files, by name."""
    write_tables(tables, csv_only, folder)
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_files_of_a_dataset(tmp_path):
    files = written(tmp_path / 'analysis' / 'tables', *all_tables(synthetic_dataset(trials=3)))
    names = [
        'table3',
        *(name + more for name in ('table4', 'table5', 'table6', 'table6_amcl') for more in ('', '_intervals')),
    ]
    assert sorted(files) == sorted(f'{name}.{suffix}' for name in names for suffix in ('csv', 'md', 'tex'))
    assert all(files.values())


def test_the_same_dataset_gives_the_same_bytes(tmp_path):
    first, second = (written(tmp_path / name, *all_tables(synthetic_dataset(trials=4))) for name in 'ab')
    assert first == second


def test_tables_of_no_trials_are_empty(tmp_path):
    tables = all_tables(dataset_of([]))
    assert all(table.rows == [] for table in tables)
    assert len(written(tmp_path, *tables)) == 3 * len(tables)


def test_csv_has_all_digits():
    value = 0.1 + 0.2
    table = Table('t', 'title', [Column('x_m', 'x [m]')], [[Number(value, 3)]], [])
    assert csv_text(table) == f'x_m\n{value!r}\n'


def test_numpy_numbers_do_not_show():
    table = Table(
        't',
        'title',
        [Column('x_m', 'x [m]'), Column('n', 'n')],
        [[Number(np.float64(0.5), 3), Number(np.int64(3), 0)]],
        [],
    )
    assert csv_text(table) == 'x_m,n\n0.5,3\n'


def small_table(groups=1, text='a_b'):
    columns = [
        Column('key', 'key'),
        *(Column(f'{group}{name}', name, f'group {group}') for group in range(groups) for name in ('x', 'y')),
    ]
    return Table(
        'small',
        f'Of {text}',
        columns,
        [
            [Label(text, f'100 % {text}'), *[Number(-0.0004, 3)] * (2 * groups)],
            [text, *[Number(None, 3)] * (2 * groups)],
        ],
        [f'note on {text}'],
    )


def test_markdown():
    assert markdown_text(small_table()) == (
        '**Of a\\_b**\n\n| key | group 0 x | group 0 y |\n| :--- | ---: | ---: |\n'
        '| 100 % a\\_b | 0.000 | 0.000 |\n| a\\_b | – | – |\n\n- note on a\\_b\n'
    )


def test_a_wide_table_continues_below():
    text = markdown_text(small_table(groups=9))
    assert text.count('| key |') == 3 and text.count('group 8 x') == 1
    assert all(len({line.count('|') for line in part.split('\n')}) == 1 for part in text.split('\n\n')[1:-1])
    assert latex_text(small_table(groups=9)).count(r'\begin{tabular}') == 3


@pytest.mark.parametrize('text', ['a_b', '50 %', '$x$', 'a & b', '#1', '{x}', 'a\\b', '~', '^'])
def test_latex_escapes(text):
    lines = latex_text(small_table(text=text)).split('\n')
    rows = [line for line in lines if line.endswith(r'\\')]
    assert all(line.replace(r'\&', '').count('&') in (1, 2) for line in rows) and len(rows) == 4
    assert all(char not in '\n'.join(lines[1:]).replace(rf'\{char}', '') for char in '%#_')


def test_latex_environments_are_balanced_and_tests_are_ruled_off():
    text = latex_text(goal_table(synthetic_dataset(trials=2), TABLE_4))
    for environment in ('table', 'tabular'):
        assert text.count(rf'\begin{{{environment}}}') == text.count(rf'\end{{{environment}}}') == 1
    assert text.count(r'\midrule') == 3 and text.count('{') == text.count('}')
    assert r'\multicolumn{3}{c}{40 PPR}' in text and r'\cmidrule(lr){3-5}' in text
    assert '$-$0.' in text


def test_a_table_is_written_in_each_format_or_as_csv_alone(tmp_path):
    files = written(tmp_path, small_table(), csv_only=[small_table()._replace(name='long')])
    assert sorted(files) == ['long.csv', 'small.csv', 'small.md', 'small.tex']
    assert files['small.csv'] == files['long.csv'] and files['long.csv'].startswith(b'key,0x,0y\n')
