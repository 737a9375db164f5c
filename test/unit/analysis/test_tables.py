"""All tables of a dataset, and their files."""

import math

import pytest

from diff_encoder_sim.analysis.table import rounded, write_tables
from diff_encoder_sim.analysis.tables import all_tables, path_error_table, pulse_resolution_table, variant_table
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trajectory_error import RPE_DISTANCES_M, PathError, RelativeError, RpePairs
from diff_encoder_sim.drives.trial_definition import Outcome
from paper_datasets import dataset, trial
from synthetic_trials import dataset_of, synthetic_dataset, trial_data
from table_records import records


def written(folder, tables):
    """Contents of the files, by name."""
    write_tables(tables, folder)
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_table_3_leaves_encoders_without_one_ppr_out():
    tables = {table.name: table for table in all_tables(synthetic_dataset(pprs=('90', 'ideal', '90-1024'), trials=1))}
    assert [row[0] for row in tables['table3'].rows] == ['90']


def test_files_of_a_dataset_are_the_same_each_time(tmp_path):
    files, again = (written(tmp_path / name / 'tables', all_tables(synthetic_dataset(trials=3))) for name in 'ab')
    of_goal = ('table4', 'table5', 'table6', 'table6_amcl', 'table4_minus_truth')
    names = ['table3', *(name + more for name in of_goal for more in ('', '_intervals'))]
    in_full = [f'table{number}.{suffix}' for number in range(3, 7) for suffix in ('md', 'tex')]
    assert sorted(files) == sorted([f'{name}.csv' for name in names] + in_full)
    assert all(files.values()) and files == again


DEG = math.pi / 180.0


RPE_PARTS = ('segments', 'translation_rmse_mean_m', 'rotation_rmse_mean_deg')


NOWHERE = {PoseSource.ODOM: None, PoseSource.AMCL: None, PoseSource.GLOBAL: None}


def path(ate_m, ate_max_m, yaw_deg, **rpe):
    """`rpe` as m1=(segments, translation [m], rotation [deg]) of consecutive pairs; of all pairs ten times as many."""
    consecutive = {distance_m: RelativeError(0, math.nan, math.nan) for distance_m in RPE_DISTANCES_M}
    for name, (segments, metres, degrees) in rpe.items():
        consecutive[float(name[1:])] = RelativeError(segments, metres, degrees * DEG)
    every = {key: RelativeError(10 * one[0], *(2.0 * part for part in one[1:])) for key, one in consecutive.items()}
    relative = {RpePairs.CONSECUTIVE: consecutive, RpePairs.ALL: every}
    return PathError(100, ate_m, ate_max_m, yaw_deg * DEG, yaw_deg * DEG, Pose2D(0.0, 0.0, 0.0), 20.0, relative)


def with_paths(*odometry, **other):
    """Trials of one cell, with these errors of odometry on the way and none of the other sources."""
    return [
        trial_data(number=number, paths={**NOWHERE, PoseSource.ODOM: errors}, **other)
        for number, errors in enumerate(odometry, 1)
    ]


def test_path_errors_by_hand():
    trials = with_paths(
        path(0.1, 0.5, 1.0, m1=(19, 0.01, 0.1), m5=(3, 0.03, 0.5)),
        path(0.2, 0.4, 2.0, m1=(20, 0.02, 0.3)),
        path(0.6, 0.9, 6.0, m1=(18, 0.06, 0.5)),
        None,
    )
    [row] = records(path_error_table(dataset_of(trials)))
    assert [row.pop(key) for key in ('test', 'ppr', 'source', 'trials')] == ['SL', '90', 'odom', '3']
    for name in ('rpe_10m', 'rpe_10m_all_pairs'):
        assert [row.pop(f'{name}_{part}') for part in RPE_PARTS] == ['0', '', '']
    # Mean 0.3 and squared deviations 0.04 + 0.01 + 0.09; t of 2 degrees of freedom: 4.3027.
    half = 4.302653 * math.sqrt(0.07 / 3)
    assert {name: float(value) for name, value in row.items()} == pytest.approx(
        {
            'ate_rmse_mean_m': 0.3,
            'ate_rmse_low_m': 0.3 - half,
            'ate_rmse_high_m': 0.3 + half,
            'ate_rmse_std_m': math.sqrt(0.07),
            'ate_max_m': 0.9,
            'yaw_rmse_mean_deg': 3.0,
            'rpe_1m_segments': 57,
            'rpe_1m_translation_rmse_mean_m': 0.03,
            'rpe_1m_rotation_rmse_mean_deg': 0.3,
            'rpe_1m_all_pairs_segments': 570,
            'rpe_1m_all_pairs_translation_rmse_mean_m': 0.06,
            'rpe_1m_all_pairs_rotation_rmse_mean_deg': 0.6,
            'rpe_5m_segments': 3,
            'rpe_5m_translation_rmse_mean_m': 0.03,
            'rpe_5m_rotation_rmse_mean_deg': 0.5,
            'rpe_5m_all_pairs_segments': 30,
            'rpe_5m_all_pairs_translation_rmse_mean_m': 0.06,
            'rpe_5m_all_pairs_rotation_rmse_mean_deg': 1.0,
        }
    )


def test_each_cell_and_source_with_a_path_has_a_row():
    paths = {**NOWHERE, PoseSource.ODOM: path(0.1, 0.1, 1.0), PoseSource.GLOBAL: path(0.2, 0.2, 1.0)}
    table = path_error_table(
        dataset_of(
            trial_data(test, ppr, paths=paths, varied=(('noise', '0.01'),))
            for test in ('DLD', 'SL')
            for ppr in ('90', '40')
        )
    )
    assert [(row['test'], row['noise'], row['ppr'], row['source'], row['ate_max_m']) for row in records(table)] == [
        (test, '0.01', ppr, source, largest)
        for test in ('SL', 'DLD')
        for ppr in ('40', '90')
        for source, largest in (('odom', '0.1'), ('global', '0.2'))
    ]


def test_only_datasets_with_paths_have_the_table():
    bare, driven = synthetic_dataset(trials=1), dataset_of(with_paths(path(0.1, 0.2, 1.0)))
    assert path_error_table(bare) is None
    assert [table.name for table in all_tables(driven)][-1] == 'path_errors'
    assert 'path_errors' not in [table.name for table in all_tables(bare)]


WORLD = (0.0, 0.0, 0.0)


def cell(ppr, name, size_m, trials=6, **others):
    return [
        trial('SL', ppr, number, varied=(('variant', name),), world=WORLD, odom=(size_m * number, 0.0, 1.0), **others)
        for number in range(1, trials + 1)
    ]


def test_rows_are_variants_and_columns_encoders():
    lost = cell('8192 amt102', 'restart', 2.0, outcome=Outcome.LOST)
    table = variant_table(dataset(cell('40', 'none', 0.1), cell('40', 'restart', 0.4), lost))
    assert [column.name for column in table.columns] == [
        *('test', 'variant', 'error'),
        *(f'ppr40_{head}' for head in ('median', 'quartiles', 'ratio', '95_%', 'failed')),
        *(f'ppr8192_amt102_{head}' for head in ('median', 'quartiles', 'ratio', '95_%', 'failed')),
    ]
    assert {column.group for column in table.columns[3:]} == {'40 PPR', 'amt102 (8192 counts)'}
    texts = [[rounded(entry, '-') for entry in row] for row in table.rows]
    assert texts[0] == ['SL', 'none', 'position [mm]', '350.00', '250.00', '-', '', '0', '-', '-', '-', '', '-']
    assert texts[2][:8] == ['SL', 'restart', 'position [mm]', '1400.00', '1000.00', '4.00', '4 to 4', '0']
    assert texts[2][8:] == ['7000.00', '5000.00', '-', '', '6']
    assert [row[2] for row in texts] == ['position [mm]', 'heading [deg]'] * 2


def test_table_3_of_alto():
    rows = records(pulse_resolution_table([40.0, 90.0, 1024.0, 4096.0], 0.2, 0.4))
    assert [round(float(row['linear_mm']), 2) for row in rows] == [15.71, 6.98, 0.61, 0.15]
    assert [float(row['two_wheel_angle_deg']) for row in rows] == pytest.approx([4.5, 2.0, 0.17578125, 0.0439453125])
    assert [float(row['one_wheel_angle_deg']) for row in rows] == pytest.approx([2.25, 1.0, 0.087890625, 0.02197265625])


def test_torn_trials_do_not_count_as_in_the_other_tables():
    trials = with_paths(path(0.1, 0.2, 1.0), path(9.0, 9.0, 9.0))
    trials[1] = trials[1]._replace(outcome=Outcome.TORN)
    [row] = records(path_error_table(dataset_of(trials)))
    assert (row['trials'], row['ate_max_m']) == ('1', '0.2')
