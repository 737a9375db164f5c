"""The paper's implied means beside ours."""

from diff_encoder_sim.analysis.paper.report_section import mean_table
from paper_datasets import cell, dataset


def entries(*cells):
    table = mean_table({'one': dataset(*cells)})
    return [dict(zip((column.name for column in table.columns), row)) for row in table.rows]


def numbers(text):
    value, low, _, high = text.replace('(', '').replace(')', '').split()
    return float(low), float(value), float(high)


def test_a_row_has_the_means_of_the_paper_and_ours():
    rows = [(0.01 + 0.001 * (-1) ** number, 0.0, 2.0) for number in range(30)]
    [row] = [one for one in entries(cell('DLD', '4096', 'odom', rows)) if one['source'] == '/odom']
    low, value, high = numbers(row['yaw_deg_paper'])
    assert low < -0.90 < high and -1.0 < value < -0.85
    assert numbers(row['x_m_ours']) == (0.01, 0.01, 0.01)


def test_a_source_without_trials_and_what_the_errata_affect_are_left_open():
    of_smt = entries(cell('SMT', '40', 'odom', [(0.0, 0.0, 0.0)] * 3))
    assert [row['source'] for row in of_smt] == ['/odom', '/world_pose', '/global_pose']
    assert [row['x_m_ours'] for row in of_smt] == ['0.000 (0.000 to 0.000)', '–', '–']
    assert {row['yaw_deg_paper'] for row in of_smt} == {'–'}


def test_a_cell_that_the_paper_does_not_have_has_no_row():
    assert entries(cell('SL', '8192', 'odom', [(0.0, 0.0, 0.0)] * 3)) == []


def test_two_datasets_have_a_column_each():
    here, there = (dataset(cell('SL', '40', 'odom', [(x, 0.0, 0.0)] * 3)) for x in (0.1, 0.2))
    table = mean_table({'here': here, 'there': there})
    [row] = [row for row in table.rows if row[0] == '/odom']
    assert [column.name for column in table.columns][2:5] == ['x_m_paper', 'x_m_here', 'x_m_there']
    assert [numbers(text)[1] for text in row[3:5]] == [0.1, 0.2]
