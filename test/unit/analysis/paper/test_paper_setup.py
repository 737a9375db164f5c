"""Which trials the paper's numbers are about."""

import pytest

from diff_encoder_sim.analysis.dataset import RobotGeometry
from diff_encoder_sim.analysis.paper.paper_cells import of_paper
from paper_datasets import IN, cell, navigated, paper_dataset

SL = navigated('SL')


@pytest.fixture
def made():
    return paper_dataset(cell('SL', '40', 'odom', [IN] * 2), cell('SMT', '40', 'odom', [IN] * 3))


def left_of(dataset):
    return {trial.test for trial in of_paper(dataset).trials}


def manifest(footprint):
    """Of a campaign, in which only the footprint counts."""
    parameters = {'navigator': {'local_costmap': {'footprint': footprint}}}
    return {'robot': {'name': 'alto'}, 'configuration': {'parameters': [parameters]}}


def test_all_trials_of_its_robot_and_tests_are(made):
    assert left_of(made) == {'SL', 'SMT'}


@pytest.mark.parametrize('wheels', [(0.066, 0.16), (0.2, 0.3), (0.25, 0.4)])
def test_another_robot_is_told_by_its_wheels(made, wheels):
    assert left_of(made._replace(robot=RobotGeometry(*wheels))) == set()


def test_calibrated_wheels_make_no_other_robot(made):
    assert left_of(made._replace(robot=RobotGeometry(0.2003, 0.399))) == {'SL', 'SMT'}


def test_another_robot_with_the_same_wheels_is_told_by_its_outline(made):
    alto, square = ([[x, y], [x, -y], [-x, -y], [-x, y]] for x, y in ((0.25, 0.3), (0.25, 0.25)))
    assert left_of(made._replace(manifest=manifest(alto))) == {'SL', 'SMT'}
    assert left_of(made._replace(manifest=manifest(square))) == set()


@pytest.mark.parametrize('footprint', [None, [], [[0.1]], 'round'])
def test_an_outline_that_is_none_says_nothing(made, footprint):
    assert left_of(made._replace(manifest=manifest(footprint))) == {'SL', 'SMT'}


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


def test_a_test_that_the_package_does_not_have_is_none_of_the_papers(made):
    own = navigated('SL').test.model_copy(update={'name': 'own'})
    requested = {'SL': SL.model_copy(update={'test': own})}
    assert left_of(made._replace(requested=requested)) == set()
