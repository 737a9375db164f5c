"""Tables 3 to 6 and their intervals, errors over the whole path, and the cost of variants."""

import math

import pytest

from diff_encoder_sim.analysis import tables
from diff_encoder_sim.analysis.quantities import MINUS_TRUTH
from diff_encoder_sim.analysis.results_table import PATH_COLUMNS
from diff_encoder_sim.analysis.tables import GOAL_TABLES
from trial_tables import ALTO, cell, column, results_of, synthetic_results, trial


def goal(results, pose='odom'):
    return tables.goal_table(results, pose, tables.estimates(results, pose))


def test_table_3_of_alto():
    table = tables.pulse_resolution_table([40.0, 90.0, 1024.0, 4096.0], ALTO)
    assert list(column(table, 'linear_mm', 'ppr').values()) == pytest.approx([15.71, 6.98, 0.614, 0.153], abs=0.005)
    for name, degrees in (('two_wheel', 180.0), ('one_wheel', 90.0)):
        expected = {f'{ppr}': degrees / ppr for ppr in (40, 90, 1024, 4096)}
        assert column(table, f'{name}_angle_deg', 'ppr') == pytest.approx(expected)


def test_table_4_and_its_intervals_by_hand():
    # Within 0.05 m: 2 and 1 of three trials; within 3 degrees: 2.
    results = results_of(cell('SL', '90', 'odom', [(0.00, 0.10, 1.0), (0.03, -0.10, -2.0), (-0.06, 0.00, 4.0)]))
    found_of = tables.estimates(results, 'odom')
    table = tables.goal_table(results, 'odom', found_of)
    assert list(table.exact.columns) == ['test', 'statistic', 'ppr90_x_m', 'ppr90_y_m', 'ppr90_yaw_deg']
    for name, expected in {
        'ppr90_x_m': (-0.06, 0.03, -0.01, math.sqrt(0.0021), 200 / 3, 3),
        'ppr90_y_m': (-0.1, 0.1, 0.0, 0.1, 100 / 3, 3),
        'ppr90_yaw_deg': (-2.0, 4.0, 1.0, 3.0, 200 / 3, 3),
    }.items():
        found = column(table, name)
        assert list(found) == ['min', 'max', 'mean', 'std', 'pct_within', 'trials']
        assert list(found.values()) == pytest.approx(expected)
    assert isinstance(column(table, 'ppr90_x_m')['trials'], int)
    # t of 2 degrees of freedom: 4.3027; chi-square of 2 at 2.5 and 97.5 %: 0.050636 and 7.377759.
    row, half = tables.interval_table('odom', found_of).exact.iloc[0], 4.302653 * math.sqrt(0.0021 / 3)
    bounds = row[['mean_low', 'mean_high', 'std_low', 'std_high']].tolist()
    stds = [math.sqrt(0.0042 / quantile) for quantile in (7.377759, 0.0506356)]
    assert bounds == pytest.approx([-0.01 - half, -0.01 + half, *stds], rel=1e-5)


def test_each_table_has_its_pose_and_its_order():
    poses = {name: (float(place), 0.0, 0.0) for place, name in enumerate(('odom', 'world', 'global', 'amcl'), start=1)}
    results = results_of([trial(test, ppr, **poses) for test in ('DLD', 'SL') for ppr in ('40', '90', 'ideal')])
    tables = [goal(results, pose) for pose in GOAL_TABLES]
    means = {table.name: column(table, 'ppr90_x_m')['mean'] for table in tables}
    assert means == {'table4': 1.0, 'table5': 2.0, 'table6': 3.0, 'table6_amcl': 4.0, 'table4_minus_truth': -1.0}
    assert list(tables[0].exact['test'].unique()) == ['SL', 'DLD']
    groups = list(dict.fromkeys(tables[0].column(name).group for name in tables[0].exact.columns))
    assert groups == ['', '40 PPR', '90 PPR', 'ideal odometry']


def test_odometry_minus_truth_leaves_out_where_the_robot_stopped():
    poses = ({'odom': (0.3, 0.0, 179.0), 'world': (0.31, 0.0, -178.0)}, {'odom': (0.3, 0.0, 0.0)})
    table = goal(results_of([trial('SL', '90', number, **of) for number, of in enumerate(poses)]), MINUS_TRUTH)
    assert column(table, 'ppr90_x_m')['pct_within'] == 100.0 and column(table, 'ppr90_x_m')['trials'] == 1
    assert column(table, 'ppr90_yaw_deg')['mean'] == pytest.approx(-3.0)


def test_a_cell_without_trials_is_empty_and_varied_parameters_are_columns():
    trials = [trial('SL', '40', odom=(0, 0, 0), slip='0.1'), trial('SMT', '90', odom=(0, 0, 0), slip='0')]
    found = goal(results_of(trials, varied=['slip'])).exact.set_index(['statistic', 'test'])
    slip, there, missing, *_ = found.loc[('mean', 'SL'), ['slip', 'ppr40_x_m', 'ppr90_x_m']]
    assert (slip, there) == ('0.1', 0.0) and math.isnan(missing)
    assert found.loc['trials', 'ppr90_x_m'].tolist() == [0, 1]


def test_failed_trials_count_as_they_ended():
    endings = [('succeeded', (0.0, 0.0, 0.0)), ('collision', (9.0, 0.0, 0.0)), ('timed_out', None)]
    trials = [trial('SL', '90', number, name, odom=end) for number, (name, end) in enumerate(endings)]
    table = goal(results_of(trials, cell('SL', '40', 'odom', [(0.0, 0.0, 0.0)])))
    numbers = column(table, 'ppr90_x_m')
    assert (numbers['max'], numbers['pct_within'], numbers['trials']) == (9.0, 50.0, 2.0)


def with_path(number, ate_m, ate_max_m, yaw_deg, test='SL', ppr='90', **rpe):
    """A trial with a path; `rpe` as m1=(segments, translation [m], rotation [deg]), twice as large of all pairs."""
    path = {name: 0 if name.endswith('segments') else math.nan for name in PATH_COLUMNS[:-2]}
    found = {'ate_rmse_m': ate_m, 'ate_max_m': ate_max_m, 'yaw_rmse_rad': math.radians(yaw_deg)}
    for name, (segments, metres, degrees) in rpe.items():
        for factor, begin in ((1, f'rpe_{name[1:]}m'), (2, f'rpe_{name[1:]}m_all_pairs')):
            values = {'segments': segments, 'translation_rmse_m': metres, 'rotation_rmse_rad': math.radians(degrees)}
            found.update({f'{begin}_{part}': factor * value for part, value in values.items()})
    path.update({f'odom_{part}': value for part, value in found.items()})
    return trial(test, ppr, number, odom=(0, 0, 0), **path)


def test_path_errors_by_hand():
    trials = [
        with_path(1, 0.1, 0.5, 1.0, m1=(19, 0.01, 0.1), m5=(3, 0.03, 0.5)),
        with_path(2, 0.2, 0.4, 2.0, m1=(20, 0.02, 0.3)),
        with_path(3, 0.6, 0.9, 6.0, m1=(18, 0.06, 0.5)),
        trial('SL', '90', 4, odom=(0, 0, 0)),
        {**with_path(5, 9.0, 9.0, 9.0), 'odom_x_m': math.nan},  # without a final pose, as in the other tables
    ]
    [row] = tables.path_error_table(results_of(trials)).exact.to_dict('records')
    assert [row.pop(key) for key in ('test', 'ppr', 'source', 'trials')] == ['SL', '90', 'odom', 3]
    # Mean 0.3 and squared deviations 0.04 + 0.01 + 0.09; t of 2 degrees of freedom: 4.3027.
    half, std = 4.302653 * math.sqrt(0.07 / 3), math.sqrt(0.07)
    ate_rmse_m = {'mean': 0.3, 'low': 0.3 - half, 'high': 0.3 + half, 'std': std}
    expected = {f'ate_rmse_{part}_m': value for part, value in ate_rmse_m.items()}
    expected.update(ate_max_m=0.9, yaw_rmse_mean_deg=3.0)
    parts = ('segments', 'translation_rmse_mean_m', 'rotation_rmse_mean_deg')
    for name, numbers in {'1m': (57, 0.03, 0.3), '5m': (3, 0.03, 0.5)}.items():
        for factor, begin in ((1, f'rpe_{name}'), (2, f'rpe_{name}_all_pairs')):
            expected.update({f'{begin}_{part}': factor * number for part, number in zip(parts, numbers)})
    expected.update({f'{begin}_{part}': math.nan for begin in ('rpe_10m', 'rpe_10m_all_pairs') for part in parts})
    assert row == pytest.approx({**expected, 'rpe_10m_segments': 0, 'rpe_10m_all_pairs_segments': 0}, nan_ok=True)


def test_each_cell_and_source_with_a_path_has_a_row():
    trials = [
        {**with_path(1, 0.1, 0.1, 1.0, test, ppr), 'global_ate_rmse_m': 0.2, 'global_x_m': 0.0, 'noise': '0.01'}
        for test in ('DLD', 'SL')
        for ppr in ('90', '40')
    ]
    found = tables.path_error_table(results_of(trials, varied=['noise'])).exact
    rows = found[['test', 'noise', 'ppr', 'source', 'ate_rmse_mean_m']].values.tolist()
    cells = [(test, '0.01', ppr) for test in ('SL', 'DLD') for ppr in ('40', '90')]
    assert rows == [[*cell, *pose] for cell in cells for pose in (('odom', 0.1), ('global', 0.2))]
    assert tables.path_error_table(synthetic_results(trials=1)) is None


def in_variant(name, sizes_m, ppr='40', **columns):
    """Trials whose odometry is off by these distances, and by as many degrees."""
    return [
        trial('SL', ppr, number, variant=name, world=(1.0, 2.0, 3.0), odom=(1.0 + size, 2.0, 3.0 + size), **columns)
        for number, size in enumerate(sizes_m, start=1)
    ]


def errors_of(*cells):
    found = tables.variant_errors(results_of(*cells, varied=['variant']))
    return {(row['variant'], row['error']): row for row in found.to_dict('records')}


def test_the_error_of_a_variant_is_the_odometrys_own_and_its_ratio_that_of_equal_trials():
    sizes = [0.1, 0.02, 0.3, 0.04, 0.5, 0.06, 0.7, 0.08]
    missed = in_variant('missed 1 %', [3.0 * size for size in sizes], outcome='lost')[1:]
    every = errors_of(in_variant('none', sizes), missed)
    found, first = every['missed 1 %', 'position_mm'], every['none', 'position_mm']
    assert [first[name] for name in ('median', 'low', 'high')] == pytest.approx([90.0, 55.0, 350.0])
    assert every['none', 'heading_deg']['median'] == pytest.approx(0.09) and math.isnan(first['ratio'])
    assert [found[name] for name in ('ratio', 'ratio_low', 'ratio_high')] == pytest.approx([3.0, 3.0, 3.0])
    assert (first['failed'], first['trials'], found['failed'], found['trials']) == (0, 8, 7, 7)
    few = errors_of(in_variant('none', [0.1, 0.1]), in_variant('some', [0.2, 0.8]))['some', 'position_mm']
    assert few['ratio'] == pytest.approx(4.0) and (few['ratio_low'], few['ratio_high']) == (0.0, math.inf)


def test_rows_are_variants_and_columns_encoders():
    sizes = [0.1 * number for number in range(1, 7)]
    lost = in_variant('restart', [20 * size for size in sizes], '8192 amt102', outcome='lost')
    cells = in_variant('none', sizes), in_variant('restart', [4 * size for size in sizes])
    table = tables.variant_table(results_of(*cells, lost, varied=['variant']))
    parts = ('median', 'quartiles', 'ratio', '95_%', 'failed')
    names = [f'ppr{label}_{part}' for label in ('40', '8192_amt102') for part in parts]
    assert list(table.exact.columns) == ['test', 'variant', 'error', *names]
    texts = table.shown().values.tolist()
    assert [row[2] for row in texts] == ['position [mm]', 'heading [deg]'] * 2
    assert texts[0][3:] == ['350.00', '250.00', '–', '', '0', '–', '–', '–', '', '–']
    assert texts[2][3:] == ['1400.00', '1000.00', '4.00', '4 to 4', '0', '7000.00', '5000.00', '–', '', '6']
    assert tables.variant_table(synthetic_results(trials=1)) is None
