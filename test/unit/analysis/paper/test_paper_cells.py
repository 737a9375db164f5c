"""The paper's numbers and errata, and which trials they are about."""

import pytest

from diff_encoder_sim.analysis.paper.paper_cells import STATISTICS, load_paper_cells, of_paper
from diff_encoder_sim.analysis.results_table import RobotGeometry
from trial_tables import IN, cell, navigated, paper_results


def test_every_cell_is_there_once_as_printed_and_those_of_errata_are_marked():
    cells = load_paper_cells()
    printed = cells.set_index(['source', 'test', 'ppr', 'quantity', 'statistic'])
    assert len(cells) == 432 and printed.index.is_unique and set(cells['statistic']) == set(STATISTICS)
    assert set(zip(cells['table'], cells['source'])) == {(4, 'odom'), (5, 'world'), (6, 'global')}
    assert printed.loc[('odom', 'SL', '40', 'y_m', 'std'), 'paper'] == 0.214
    outlier = printed.loc[('world', 'SMT', '40', 'yaw_deg', 'max'), ['paper', 'left_out']]
    assert outlier.tolist() == [80.341, 'smt_outlier_40']
    marked = {'': 398, 'smt_column_twice': 24, 'smt_outlier_40': 6, 'calibrated': 4}
    assert dict(cells['left_out'].value_counts()) == marked
    of_smt = cells[(cells['test'] == 'SMT') & cells['table'].isin([5, 6])]
    repeated, original = (of_smt[of_smt['ppr'] == ppr] for ppr in ('1024', '90'))
    assert repeated['paper'].tolist() == original['paper'].tolist()
    assert set(repeated['left_out']) == {'smt_column_twice'}


MADE = paper_results(cell('SL', '40', 'odom', [IN] * 2), cell('SMT', '40', 'odom', [IN] * 3))


def left_of(results):
    return set(of_paper(results).trials['test'])


@pytest.mark.parametrize(
    ('wheels', 'y_m', 'is_papers'),
    [
        ((0.2, 0.3), 0.3, False),
        ((0.25, 0.4), 0.3, False),
        ((0.2003, 0.399), 0.3, True),  # calibrated
        ((0.2, 0.4), 0.25, False),  # another outline
    ],
)
def test_another_robot_is_recognized_by_its_wheels_and_outline(wheels, y_m, is_papers):
    corners = [[x, y] for x in (0.25, -0.25) for y in (y_m, -y_m)]
    manifest = {'configuration': {'parameters': [{'navigator': {'local_costmap': {'footprint': corners}}}]}}
    made = MADE._replace(robot=RobotGeometry(*wheels), manifest=manifest)
    assert left_of(made) == ({'SL', 'SMT'} if is_papers else set())


def test_another_test_of_the_same_name_is_none_of_the_papers():
    own = navigated('SL')
    elsewhere = own.model_copy(update={'test': own.test.model_copy(update={'world': 'corridor'})})
    for changed in (own.model_copy(update={'nav': 'scripted'}), elsewhere):
        assert left_of(MADE._replace(requested={**MADE.requested, 'SL': changed})) == {'SMT'}
