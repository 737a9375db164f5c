"""The comparison of datasets with the paper, and that nothing else depends on the paper."""

import re

import pytest

from diff_encoder_sim.analysis.paper.comparison import compare_with_paper
from diff_encoder_sim.analysis.paper.report_section import all_cells_table, cell_tables, paper_section, score_table
from diff_encoder_sim.base.errors import ConfigError
from paper_datasets import IN, OUT, cell, dataset, paper_dataset
from places import SOURCE

ANALYSIS = SOURCE / 'diff_encoder_sim' / 'analysis'


def test_only_the_report_and_the_writing_of_files_import_the_paper():
    importers = [
        str(path.relative_to(ANALYSIS.parent))
        for path in sorted(ANALYSIS.parent.rglob('*.py'))
        if path.parent != ANALYSIS / 'paper'
        and re.search(r'import.*analysis\.paper|analysis\.paper.*import', path.read_text())
    ]
    assert importers == ['analysis/outputs.py', 'analysis/report/page.py']


def test_a_dataset_that_has_no_cell_of_the_paper_has_no_tables():
    assert paper_section([paper_dataset(cell('own', '40', 'odom', [(0.0, 0.0, 0.0)] * 3))]) is None


def test_another_dataset_is_a_reading_beside_the_first(tmp_path):
    first, second = (paper_dataset(cell('SL', '40', 'odom', rows * 30)) for rows in ([IN], [OUT]))
    section = paper_section([first._replace(title='a'), second._replace(title='b')])
    assert list(section.claims) == ['a', 'b'] and section.has_enough_trials
    assert {row[0] for row in section.all_cells.rows} == {'a', 'b'}
    same = paper_section([first._replace(folder=tmp_path / 'a'), second._replace(folder=tmp_path / 'b')])
    assert list(same.claims) == [f'{tmp_path}/a', f'{tmp_path}/b']


def reading(tests, size=0.001):
    """The compared cells of thirty trials at 40 PPR, spread by `size` times -15 to 14."""
    rows = [(size * (number - 15),) * 3 for number in range(30)]
    return compare_with_paper(dataset(*(cell(test, '40', 'world', rows) for test in tests))).rows


def test_scores_are_by_source_and_test_and_beside_each_other():
    table = score_table({'a': reading(['SL', 'DLD']), 'b': reading(['SL'], size=10.0)})
    assert [row[:2] for row in table.rows] == [['/world_pose', 'SL'], ['/world_pose', 'DLD'], ['all', '']]
    assert [column.name for column in table.columns][2:] == ['a_compared', 'a_agree', 'b_compared', 'b_agree']
    (a, a_agree, b, b_agree), (_, _, none, _), (total, total_agree, *_) = (
        [entry.value for entry in row[2:]] for row in table.rows
    )
    assert a == b == 12 and total == 24 and none is None and b_agree < a_agree <= total_agree <= total


def test_another_dataset_must_have_cells_of_the_paper():
    has, has_not = (paper_dataset(cell(test, '40', 'odom', [IN] * 3)) for test in ('SL', 'own'))
    for pair in ([has, has_not], [has_not, has]):
        with pytest.raises(
            ConfigError, match=r"has no cell of the paper; expected the paper's robot and tests \(SL, SMT or DLD"
        ):
            paper_section(pair)


def row_of(table, error):
    (row,) = (row for row in table.rows if row[1] == error)
    return dict(zip((column.name for column in table.columns), row))


def test_differences_errata_and_calibrated_numbers_are_marked():
    rows = [(0.0, 0.2 * (-1) ** number, 1.0) for number in range(30)]
    of_sl, of_1024, of_smt = (
        cell_tables({'ours': compare_with_paper(dataset(cell(test, ppr, 'odom', rows))).rows})[0]
        for test, ppr in (('SL', '4096'), ('SL', '1024'), ('SMT', '40'))
    )
    assert row_of(of_sl, 'y [m]')['std_printed'] == '0.033'
    assert row_of(of_sl, 'y [m]')['std_ours'] == '0.203 (0.162 to 0.273) *'  # not tested
    assert row_of(of_1024, 'y [m]')['std_ours'] == '0.203 (0.162 to 0.273) ≠'
    assert row_of(of_smt, 'yaw [deg]')['std_printed'].endswith(' †')


def test_readings_are_side_by_side_without_intervals():
    rows = [(0.0, 0.2 * (-1) ** number, 1.0) for number in range(30)]
    first = compare_with_paper(dataset(cell('SL', '40', 'odom', rows))).rows
    second = compare_with_paper(dataset(cell('SL', '90', 'odom', rows))).rows
    [table] = cell_tables({'paper': first, 'b': second})
    assert [row[0] for row in table.rows] == 3 * ['SL, 40 PPR'] + 3 * ['SL, 90 PPR']
    assert row_of(table._replace(rows=table.rows[:3]), 'y [m]')['std_paper'] == '0.203'
    assert row_of(table._replace(rows=table.rows[:3]), 'y [m]')['std_b'] == '–'
    assert [row[0] for row in all_cells_table({'a': first, 'b': second}).rows] == 12 * ['a'] + 12 * ['b']
