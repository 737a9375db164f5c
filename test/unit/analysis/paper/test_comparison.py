"""The paper's numbers and errata, the trials that they are about, and each number against ours."""

import math

import numpy as np
import pytest
from scipy import stats

from diff_encoder_sim.analysis.paper import comparison
from diff_encoder_sim.analysis.paper.comparison import STATISTICS, agreement, is_evidence, load_paper_cells, of_paper
from diff_encoder_sim.analysis.quantities import YAW, X
from diff_encoder_sim.analysis.results_table import RobotGeometry, campaign_names
from diff_encoder_sim.analysis.statistics import Interval, holm
from trial_tables import IN, cell, navigated, paper_results, results_of

MADE = paper_results(cell('SL', '40', 'odom', [IN] * 2), cell('SMT', '40', 'odom', [IN] * 3))


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


def left_of(results):
    return set(of_paper(results).trials['test'])


@pytest.mark.parametrize(('wheels', 'is_papers'), [((0.2, 0.3), False), ((0.25, 0.4), False), ((0.2003, 0.399), True)])
def test_another_robot_is_recognized_by_its_wheels_unless_they_are_calibrated(wheels, is_papers):
    assert left_of(MADE._replace(robot=RobotGeometry(*wheels))) == ({'SL', 'SMT'} if is_papers else set())


def test_another_test_of_the_same_name_is_none_of_the_papers():
    own = navigated('SL')
    elsewhere = own.model_copy(update={'test': own.test.model_copy(update={'world': 'corridor'})})
    for changed in (own.model_copy(update={'nav': 'scripted'}), elsewhere):
        assert left_of(MADE._replace(requested={**MADE.requested, 'SL': changed})) == {'SMT'}


def test_spreads_by_the_f_test():
    values = np.array([-1.0, 1.0] * 15) * math.sqrt(29.0 / 30.0)  # a spread of 1
    theirs = 1.5 - 0.0005  # the nearest that rounds so
    expected = 2.0 * stats.f(29, 29).cdf(1.0 / theirs**2)
    found = agreement('std', values, 1.5, YAW)
    assert found.p_value == pytest.approx(expected)
    assert 0.03 < expected < 0.04  # 0.80 to 1.34


def test_per_cents_by_fishers_test():
    values = np.array([0.0] * 4 + [1.0] * 6)
    found = agreement('pct_within', values, 90.0, X)
    assert found.ours == 40.0
    assert found.p_value == pytest.approx(stats.fisher_exact([[4, 6], [27, 3]])[1])
    assert found.interval.low < 40.0 < found.interval.high
    assert agreement('pct_within', np.array([]), 90.0, X) is None


def test_a_minimum_is_a_maximum_of_the_opposite():
    values = np.random.default_rng(1).standard_normal(30)
    for printed in (-9.0, -2.0, 0.0):
        low, high = agreement('min', values, printed, YAW), agreement('max', -values, -printed, YAW)
        assert (low.ours, low.p_value) == (-high.ours, high.p_value)


@pytest.mark.parametrize('decimals', [9, 0], ids=['normal', 'whole pulses'])
def test_families_of_equal_robots_are_rarely_contradicted(decimals):
    """A family is 12 cells of 4 statistics, the paper's of its own 30 trials: in one of twenty at most one differs."""
    draws = np.random.default_rng(3).standard_normal((60, 12, 2, 30)).round(decimals)
    families = [[each for ours, theirs in family for each in p_values(ours, theirs)] for family in draws]
    assert np.mean([p_value < 0.05 for family in families for p_value in family]) <= 0.05
    assert np.mean([min(holm(family)) < 0.05 for family in families]) <= 0.05


def p_values(ours, theirs):
    within = 100.0 * np.mean(np.abs(theirs) <= 1.0)
    printed = {'min': theirs.min(), 'max': theirs.max(), 'std': theirs.std(ddof=1), 'pct_within': within}
    found = [agreement(statistic, ours, value, YAW._replace(tolerance=1.0)) for statistic, value in printed.items()]
    return [1.0 if each.p_value is None else each.p_value for each in found]


def p_of(values, reported):
    return comparison.maximum_p_value(np.asarray(values, dtype=float), Interval(reported, reported), 30)


def test_a_maximum_below_many_of_ours_is_one_of_the_orders_of_both():
    # All of our three above all of their thirty: one of C(33, 3) = 5456 orders, two-sided.
    assert p_of([2.0, 3.0, 4.0], 1.0) == pytest.approx(2.0 / 5456.0)


def test_beyond_ours_the_tail_is_exponential():
    """The chance that theirs lies so many estimated scales beyond ours, counted over exponential samples."""
    rng = np.random.default_rng(4)
    ours, theirs = rng.exponential(size=(2, 4000, 30))
    is_small = [p_of(a, b.max()) < 0.05 and b.max() > a.max() for a, b in zip(ours, theirs)]
    assert np.mean(is_small) == pytest.approx(0.025, abs=0.006)


def compared_with(*cells, varied=()):
    results = results_of(*cells, varied=varied)
    return comparison.compare_with_paper(results.trials.assign(campaign=campaign_names(results, '')))


def test_only_cells_that_both_have_are_compared_whatever_the_outcome():
    rows = [(-0.03, 0.01, 1.0), (-0.02, -0.01, 2.0), (0.0, 0.04, 1.5)]
    cells = [cell(*name, 'odom', rows, outcome='lost') for name in (('SL', '40'), ('SL', '128'), ('own', '40'))]
    compared = compared_with(*cells)
    assert len(compared) == 12 and set(compared['trials']) == {3}
    ours = compared.set_index(['quantity', 'statistic'])['ours']
    expected = {('x_m', 'min'): -0.03, ('yaw_deg', 'max'): 2.0, ('yaw_deg', 'std'): 0.5, ('y_m', 'pct_within'): 100.0}
    assert {key: ours[key] for key in expected} == pytest.approx(expected)


def test_a_family_is_corrected_for_its_own_cells_only():
    rows = [(0.001 * number, 0.0, 0.1 * number) for number in range(30)]
    alone = compared_with(cell('SL', '40', 'odom', rows))
    cells = [cell('SL', '40', 'odom', rows, noise=noise) for noise in ('0', '0.1')]
    among = compared_with(*cells, cell('SMT', '40', 'odom', rows, noise='0'), varied=['noise'])
    assert list(among['campaign']) == ['noise 0'] * 24 + ['noise 0.1'] * 12
    for noise in ('noise 0', 'noise 0.1'):
        of_sl = among[(among['test'] == 'SL') & (among['campaign'] == noise)]
        assert of_sl['p_holm'].tolist() == pytest.approx(alone['p_holm'].tolist(), nan_ok=True)
    [tested] = alone[(alone['quantity'] == 'y_m') & (alone['statistic'] == 'pct_within')].to_dict('records')
    assert tested['p_holm'] > tested['p']


def test_cells_that_errata_affect_or_that_were_fitted_are_no_evidence():
    compared = compared_with(cell('SMT', '1024', 'world', [(0.0, 0.0, 0.0)] * 30))
    assert len(compared) == 12 and not is_evidence(compared).any() and comparison.score(compared) == (0, 0)
    rows = [(0.0, 0.0, 0.0), (0.1, 0.0, 0.0)]
    compared = compared_with(*(cell('SL', *of, rows) for of in (('4096', 'odom'), ('1024', 'odom'), ('4096', 'world'))))
    of_fit = compared['left_out'] == 'calibrated'
    assert of_fit.sum() == 4 and not is_evidence(compared)[of_fit].any()  # of y in SL
