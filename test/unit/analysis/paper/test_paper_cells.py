"""The paper's numbers and errata, and which trials they are about."""

import pytest

from diff_encoder_sim.analysis.paper.paper_cells import STATISTICS, load_errata, load_paper_cells, of_paper
from diff_encoder_sim.analysis.quantities import QUANTITIES
from diff_encoder_sim.analysis.results_table import RobotGeometry
from trial_tables import IN, cell, navigated, paper_results


@pytest.fixture(scope='module')
def printed():
    return {(one.source, one.test, one.ppr, one.quantity.name, one.statistic): one for one in load_paper_cells()}


def test_every_cell_is_there_once(printed):
    assert len(load_paper_cells()) == len(printed) == 432
    assert {one.quantity for one in printed.values()} == set(QUANTITIES)
    assert {one.statistic for one in printed.values()} == set(STATISTICS)


def test_cells_are_those_of_the_print(printed):
    assert printed['odom', 'SL', '40', 'y_m', 'std'].value == 0.214
    assert printed['world', 'SMT', '40', 'yaw_deg', 'max'].value == 80.341
    assert printed['global', 'DLD', '40', 'yaw_deg', 'pct_within'].value == 73.3
    assert {(one.table, one.source) for one in printed.values()} == {(4, 'odom'), (5, 'world'), (6, 'global')}


def test_the_repeated_column_is_marked_and_is_repeated(printed):
    affected = [one for one in printed.values() if 'smt_column_twice' in one.left_out]
    assert len(affected) == 24 and 'smt_column_twice' in [one['key'] for one in load_errata()]
    for one in affected:
        assert (
            one.ppr == '1024' and one.value == printed[one.source, 'SMT', '90', one.quantity.name, one.statistic].value
        )


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
