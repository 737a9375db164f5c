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


@pytest.mark.parametrize(
    ('wheels', 'is_papers'),
    [
        ((0.066, 0.16), False),
        ((0.2, 0.3), False),
        ((0.25, 0.4), False),
        ((0.2003, 0.399), True),
    ],  # the last: calibrated
)
def test_another_robot_is_recognized_by_its_wheels(made, wheels, is_papers):
    assert left_of(made._replace(robot=RobotGeometry(*wheels))) == ({'SL', 'SMT'} if is_papers else set())


@pytest.mark.parametrize(('y_m', 'left'), [(0.3, {'SL', 'SMT'}), (0.25, set())])
def test_another_robot_with_the_same_wheels_is_recognized_by_its_outline(made, y_m, left):
    corners = [[x, y] for x in (0.25, -0.25) for y in (y_m, -y_m)]
    parameters = {'navigator': {'local_costmap': {'footprint': corners}}}
    manifest = {'robot': {'name': 'alto'}, 'configuration': {'parameters': [parameters]}}
    assert left_of(made._replace(manifest=manifest)) == left


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
