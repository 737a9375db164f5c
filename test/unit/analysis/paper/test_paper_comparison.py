"""The paper's numbers as data, and the comparison with ours, against values worked out by hand."""

import math

import numpy as np
import pytest
from scipy import stats

from diff_encoder_sim.analysis.paper.errata import ERRATA, errata_of
from diff_encoder_sim.analysis.paper.paper_cells import STATISTICS, load_paper_cells
from diff_encoder_sim.analysis.paper.paper_comparison import compare_with_paper
from diff_encoder_sim.analysis.paper.printed_resolutions import compare_resolutions
from diff_encoder_sim.analysis.paper.statistic_tests import compare_max, compare_min, compare_pct_within, compare_std
from diff_encoder_sim.analysis.pulse_resolution import pulse_resolution
from diff_encoder_sim.analysis.quantities import QUANTITIES, YAW, X
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.trials.pose_source import PoseSource
from diff_encoder_sim.trials.trial_outcome import Outcome
from paper_datasets import cell, dataset


@pytest.fixture(scope='module')
def printed():
    return {(one.source, one.test, one.ppr, one.quantity.name, one.statistic): one for one in load_paper_cells()}


# ---- the data


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


# ---- errata


def test_the_repeated_column_is_marked_and_is_repeated(printed):
    affected = [one for one in printed.values() if 'smt_column_twice' in errata_of(one)]
    assert len(affected) == 24
    for one in affected:
        assert (
            one.ppr == '1024' and one.value == printed[one.source, 'SMT', '90', one.quantity.name, one.statistic].value
        )


def test_one_trial_makes_the_spread_at_40_ppr(printed):
    for source in (PoseSource.ODOM, PoseSource.WORLD, PoseSource.GLOBAL):
        most = printed[source, 'SMT', '40', 'yaw_deg', 'max'].value
        spread = printed[source, 'SMT', '40', 'yaw_deg', 'std'].value
        assert spread == pytest.approx(most / math.sqrt(30), rel=0.05)
        assert errata_of(printed[source, 'SMT', '40', 'yaw_deg', 'std']) == ['smt_outlier_40']
        assert errata_of(printed[source, 'SMT', '40', 'x_m', 'std']) == []


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


def test_errata_have_keys_of_their_own():
    assert len({erratum.key for erratum in ERRATA}) == len(ERRATA)


# ---- table 3


def test_table_3_by_hand():
    one = pulse_resolution(90, 0.2, 0.4)
    assert one.linear_m == pytest.approx(0.00698, abs=5e-6)  # not the 7.98 mm of the print
    assert math.degrees(one.two_wheel_angle_rad) == pytest.approx(2.0)
    assert math.degrees(one.one_wheel_angle_rad) == pytest.approx(1.0)


def test_table_3_agrees_with_the_print_but_for_its_error():
    for row in compare_resolutions([40, 90, 1024, 4096], 0.2, 0.4):
        assert row.computed.two_wheel_angle_rad == pytest.approx(row.printed.angle_rad, rel=0.025)
        is_erratum = abs(row.printed.linear_m / row.computed.linear_m - 1.0) > 0.025
        assert is_erratum == (row.printed.ppr == 90)


def test_table_3_of_another_robot():
    (row,) = compare_resolutions([500.5], 0.1, 0.25)
    assert row.printed is None
    assert row.computed.linear_m == pytest.approx(math.pi * 0.1 / 500.5)


# ---- one statistic


def test_equal_spreads_agree_whatever_the_rounding():
    values = np.array([-1.0, 1.0] * 15) * 0.0332 * math.sqrt(29.0 / 30.0)
    agreement = compare_std(values, 0.033, X)
    assert agreement.ours == pytest.approx(0.0332)
    assert agreement.p_value == 1.0


def test_spreads_by_the_f_test():
    values = np.array([-1.0, 1.0] * 15) * math.sqrt(29.0 / 30.0)  # a spread of 1
    theirs = 1.5 - 0.0005  # the nearest that rounds so
    expected = 2.0 * stats.f(29, 29).cdf(1.0 / theirs**2)
    assert compare_std(values, 1.5, YAW).p_value == pytest.approx(expected)
    assert 0.03 < expected < 0.04


def test_a_spread_that_prints_as_zero():
    assert compare_std(np.array([0.0, 0.0]), 0.0, X).p_value == 1.0
    assert compare_std(np.array([0.0003, -0.0003]), 0.0, X).p_value == 1.0
    assert compare_std(np.array([0.0, 0.0]), 0.014, X).p_value == 0.0
    assert compare_std(np.array([0.1]), 0.014, X) is None


def test_per_cents_by_fishers_test():
    values = np.array([0.0] * 4 + [1.0] * 6)
    agreement = compare_pct_within(values, 90.0, X)
    assert agreement.ours == 40.0
    assert agreement.p_value == pytest.approx(stats.fisher_exact([[4, 6], [27, 3]])[1])
    assert agreement.interval.low < 40.0 < agreement.interval.high
    assert compare_pct_within(np.array([]), 90.0, X) is None


def test_extremes_by_the_order_of_both_samples():
    # All of our three above all of their thirty: one of C(33, 3) = 5456 orders, two-sided.
    assert compare_max(np.array([2.0, 3.0, 4.0]), 1.0, X).p_value == pytest.approx(2.0 / 5456.0)
    assert compare_min(np.array([-2.0, -3.0, -4.0]), -1.0, X).p_value == pytest.approx(2.0 / 5456.0)
    assert compare_min(np.array([-2.0, -3.0, -4.0]), -1.0, X).ours == -4.0


def test_an_extreme_beyond_ours_tells_nothing():
    assert compare_max(np.array([0.1, 0.2]), 80.0, X).p_value is None


def test_extremes_rarely_differ_by_chance():
    rng = np.random.default_rng(5)
    rejected = sum(
        (compare_max(ours, theirs.max(), YAW).p_value or 1.0) < 0.05
        for ours, theirs in rng.standard_normal((2000, 2, 30))
    )
    assert rejected / 2000 < 0.05


# ---- whole datasets


def test_only_cells_that_both_have_are_compared():
    rows = [(-0.03, 0.01, 1.0), (-0.02, -0.01, 2.0), (0.0, 0.04, 1.5)]
    comparison = compare_with_paper(
        dataset(cell('SL', '40', 'odom', rows), cell('SL', '128', 'odom', rows), cell('own', '40', 'odom', rows))
    )
    assert len(comparison.rows) == 12
    by_key = {(row.paper.quantity.name, row.paper.statistic): row for row in comparison.rows}
    assert by_key['x_m', 'min'].agreement.ours == -0.03
    assert by_key['yaw_deg', 'max'].agreement.ours == pytest.approx(2.0)
    assert by_key['yaw_deg', 'std'].agreement.ours == pytest.approx(0.5)
    assert by_key['y_m', 'pct_within'].agreement.ours == 100.0
    assert {row.trials for row in comparison.rows} == {3}
    assert by_key['y_m', 'pct_within'].is_compatible is False


def test_varied_parameters_are_compared_each_for_itself():
    rows = [(0.0, 0.0, 0.0), (0.1, 0.0, 0.0)]
    noisy = (('simulator.lidar.noise', '0.1'),)
    comparison = compare_with_paper(
        dataset(cell('SL', '40', 'odom', rows), cell('SL', '40', 'odom', rows, varied=noisy))
    )
    assert [row.cell.varied for row in comparison.rows] == [()] * 12 + [noisy] * 12


def test_torn_trials_do_not_count_and_failed_ones_do():
    rows = [(0.0, 0.0, 0.0), (0.01, 0.0, 0.0)]
    comparison = compare_with_paper(
        dataset(
            cell('SL', '40', 'odom', rows)
            + cell('SL', '40', 'odom', [(9.0, 9.0, 9.0)], outcome=Outcome.TORN)
            + cell('SL', '40', 'odom', [(0.5, 0.0, 0.0)], outcome=Outcome.LOST)
        )
    )
    assert {row.trials for row in comparison.rows} == {3}
    assert max(row.agreement.ours for row in comparison.rows if row.paper.statistic == 'max') == 0.5


def test_scores_leave_affected_cells_out():
    rows = [(0.0, 0.0, 0.0)] * 30
    comparison = compare_with_paper(dataset(cell('SMT', '1024', 'world', rows)))
    assert len(comparison.rows) == 12
    assert comparison.scores() == {}


def test_equal_spreads_differ_by_chance_in_one_of_twenty():
    rng = np.random.default_rng(3)
    rejected = sum(
        compare_std(ours, theirs.std(ddof=1), YAW).p_value < 0.05 for ours, theirs in rng.standard_normal((500, 2, 30))
    )
    assert 0.03 < rejected / 500 < 0.07


def test_the_resolutions_are_those_of_the_datasets_encoders_and_robot():
    comparison = compare_with_paper(
        dataset(
            cell('SL', '4096', 'odom', []),
            cell('SMT', '128', 'odom', [(0.0, 0.0, 0.0)]),
            cell('SL', '40', 'odom', [(0.0, 0.0, 0.0)]),
            cell('SL', '90L1024R', 'odom', [(0.0, 0.0, 0.0)]),
        )
    )
    assert [row.computed.ppr for row in comparison.resolutions] == [40.0, 128.0]
    assert [row.printed is not None for row in comparison.resolutions] == [True, False]


def test_calibrated_cells_are_told_apart():
    rows = [(0.0, 0.0, 0.0), (0.1, 0.0, 0.0)]
    comparison = compare_with_paper(
        dataset(cell('SL', '4096', 'odom', rows), cell('SL', '1024', 'odom', rows), cell('SL', '4096', 'world', rows))
    )
    assert sum(row.is_calibrated for row in comparison.rows) == 4  # of y in SL
    assert {key: score.tested for key, score in comparison.scores().items()} == {
        key: sum(
            row.is_compatible is not None and not row.is_calibrated
            for row in comparison.rows
            if (row.paper.source, row.paper.ppr) == key
        )
        for key in ((PoseSource.ODOM, '4096'), (PoseSource.ODOM, '1024'), (PoseSource.WORLD, '4096'))
    }
