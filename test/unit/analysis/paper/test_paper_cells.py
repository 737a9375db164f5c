"""The paper's numbers as data."""

import pytest

from diff_encoder_sim.analysis.paper.paper_cells import STATISTICS, load_paper_cells
from diff_encoder_sim.analysis.quantities import QUANTITIES, YAW
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.topics import PoseSource


@pytest.fixture(scope='module')
def printed():
    return {(one.source, one.test, one.ppr, one.quantity.name, one.statistic): one for one in load_paper_cells()}


def test_every_cell_is_there_once(printed):
    assert len(load_paper_cells()) == len(printed) == 432
    assert {one.quantity for one in printed.values()} == set(QUANTITIES)
    assert {one.statistic for one in printed.values()} == set(STATISTICS)


def test_cells_are_those_of_the_print(printed):
    assert printed[PoseSource.ODOM, 'SL', '40', 'y_m', 'std'].value == 0.214
    assert printed[PoseSource.WORLD, 'SMT', '40', 'yaw_deg', 'max'].value == 80.341
    assert printed[PoseSource.GLOBAL, 'DLD', '40', 'yaw_deg', 'pct_within'].value == 73.3
    assert {(one.table, one.source) for one in printed.values()} == {
        (4, PoseSource.ODOM),
        (5, PoseSource.WORLD),
        (6, PoseSource.GLOBAL),
    }


@pytest.mark.parametrize(
    'line', ['4,odom,SL,40,z_m,min,0.1', '4,wheels,SL,40,x_m,min,0.1', '4,odom,SL,40,x_m,min,much', '4,odom']
)
def test_a_bad_line_is_named(tmp_path, line):
    path = tmp_path / 'cells.csv'
    path.write_text(f'table,source,test,ppr,quantity,statistic,value\n{line}\n')
    with pytest.raises(ConfigError, match='cells.csv: .*allowed: lines as in'):
        load_paper_cells(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ConfigError, match='none.csv: cannot be read: No such file'):
        load_paper_cells(tmp_path / 'none.csv')


def test_what_the_text_says_of_fractions_is_not_in_the_tables(printed):
    of_truth = [
        one.value
        for one in printed.values()
        if one.statistic == 'pct_within' and one.source == PoseSource.WORLD and one.quantity is not YAW
    ]
    assert (min(of_truth), max(of_truth)) == (56.7, 100.0)
    headings = {
        ppr: [
            one.value
            for one in printed.values()
            if one.statistic == 'pct_within' and one.quantity is YAW and one.ppr == ppr
        ]
        for ppr in ('40', '90')
    }
    assert min(headings['40']) == 73.3 and max(headings['40']) == 100.0
    assert min(headings['90']) == 90.0
