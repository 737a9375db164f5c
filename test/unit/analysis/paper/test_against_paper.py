"""The paper's numbers beside ours, with marks."""

from diff_encoder_sim.analysis.paper.against_paper import cell_tables, errata_table, resolution_table, score_table
from diff_encoder_sim.analysis.paper.errata import ERRATA
from diff_encoder_sim.analysis.paper.paper_comparison import compare_with_paper
from paper_datasets import cell, dataset


def row_of(table, error):
    (row,) = (row for row in table.rows if row[1] == error)
    return dict(zip((column.name for column in table.columns), row))


def test_differences_errata_and_calibrated_numbers_are_marked():
    rows = [(0.0, 0.2 * (-1) ** number, 1.0) for number in range(30)]
    of_sl, of_smt = (
        cell_tables(compare_with_paper(dataset(cell(test, ppr, 'odom', rows))))[0]
        for test, ppr in (('SL', '4096'), ('SMT', '40'))
    )
    assert row_of(of_sl, 'y [m]')['std_paper'] == '0.033'
    assert row_of(of_sl, 'y [m]')['std_ours'] == '0.203 (0.162 to 0.273) ≠ *'
    assert row_of(of_smt, 'yaw [deg]')['std_paper'].endswith(' †')


def test_scores_are_by_source_and_encoder():
    rows = [(0.0, 0.001 * number, 0.1) for number in range(30)]
    comparison = compare_with_paper(dataset(cell('SL', '40', 'world', rows), cell('SL', '40', 'odom', rows)))
    assert [row[:2] for row in score_table(comparison).rows] == [['/odom', '40'], ['/world_pose', '40']]


def test_table_3_has_a_row_for_each_encoder():
    comparison = compare_with_paper(dataset(cell('SL', '90', 'odom', [(0.0, 0.0, 0.0)])))
    [[ppr, printed, computed, *_]] = resolution_table(comparison).rows
    assert (ppr, round(printed.value, 2), round(computed.value, 2)) == ('90', 7.98, 6.98)


def test_every_erratum_is_listed():
    assert len(errata_table().rows) == len(ERRATA)
