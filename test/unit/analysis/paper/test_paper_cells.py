"""The paper's numbers and errata, and which trials they are about."""

import pytest

from diff_encoder_sim.analysis.paper.paper_cells import STATISTICS, load_errata, load_paper_cells, of_paper
from diff_encoder_sim.analysis.results_table import RobotGeometry
from trial_tables import IN, cell, navigated, paper_results


def test_every_cell_is_there_once_as_printed():
    cells = load_paper_cells()
    printed = cells.set_index(['source', 'test', 'ppr', 'quantity', 'statistic'])
    assert len(cells) == 432 and printed.index.is_unique and set(cells['statistic']) == set(STATISTICS)
    assert set(zip(cells['table'], cells['source'])) == {(4, 'odom'), (5, 'world'), (6, 'global')}
    assert printed.loc[('odom', 'SL', '40', 'y_m', 'std'), 'paper'] == 0.214
    assert printed.loc[('world', 'SMT', '40', 'yaw_deg', 'max'), 'paper'] == 80.341
    assert printed.loc[('global', 'DLD', '40', 'yaw_deg', 'pct_within'), 'paper'] == 73.3


def test_the_repeated_column_is_marked_and_is_repeated():
    cells = load_paper_cells()
    affected = cells[cells['left_out'] == 'smt_column_twice']
    others = cells[(cells['test'] == 'SMT') & (cells['ppr'] == '90') & cells['table'].isin([5, 6])]
    assert len(affected) == 24 and set(affected['ppr']) == {'1024'}
    assert affected['paper'].tolist() == others['paper'].tolist()
    assert 'smt_column_twice' in [one['key'] for one in load_errata()]


SL = navigated('SL')


@pytest.fixture
def made():
    return paper_results(cell('SL', '40', 'odom', [IN] * 2), cell('SMT', '40', 'odom', [IN] * 3))


def left_of(results):
    return set(of_paper(results).trials['test'])


def manifest(footprint):
    """Of a campaign, in which only the footprint counts."""
    parameters = {'navigator': {'local_costmap': {'footprint': footprint}}}
    return {'robot': {'name': 'alto'}, 'configuration': {'parameters': [parameters]}}


@pytest.mark.parametrize('wheels', [(0.066, 0.16), (0.2, 0.3), (0.25, 0.4)])
def test_another_robot_is_told_by_its_wheels(made, wheels):
    assert left_of(made._replace(robot=RobotGeometry(*wheels))) == set()


def test_calibrated_wheels_make_no_other_robot(made):
    assert left_of(made._replace(robot=RobotGeometry(0.2003, 0.399))) == {'SL', 'SMT'}


def test_another_robot_with_the_same_wheels_is_told_by_its_outline(made):
    alto, square = ([[x, y], [x, -y], [-x, -y], [-x, y]] for x, y in ((0.25, 0.3), (0.25, 0.25)))
    assert left_of(made._replace(manifest=manifest(alto))) == {'SL', 'SMT'}
    assert left_of(made._replace(manifest=manifest(square))) == set()


@pytest.mark.parametrize(
    'changed',
    [
        SL.model_copy(update={'nav': 'scripted'}),
        SL.model_copy(update={'test': SL.test.model_copy(update={'world': 'corridor'})}),
        SL.model_copy(update={'test': navigated('SMT').test.model_copy(update={'name': 'SL'})}),
    ],
    ids=['without navigation', 'another world', 'another route'],
)
def test_another_test_of_the_same_name_is_none_of_the_papers(made, changed):
    assert left_of(made._replace(requested={**made.requested, 'SL': changed})) == {'SMT'}
