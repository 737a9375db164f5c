"""The paper's numbers beside ours, with marks."""

from diff_encoder_sim.analysis.paper.comparison import compare_with_paper
from diff_encoder_sim.analysis.paper.report_section import all_cells_table, cell_tables
from paper_datasets import cell, dataset


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
