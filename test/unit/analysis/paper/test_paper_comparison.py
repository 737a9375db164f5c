"""The paper's numbers beside those of whole datasets."""

import pytest

from diff_encoder_sim.analysis.paper.comparison import compare_with_paper
from diff_encoder_sim.drives.trial_definition import Outcome
from paper_datasets import cell, dataset


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
    assert by_key['y_m', 'pct_within'].agreement.p_value < 0.05


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


def test_cells_that_errata_affect_are_no_evidence():
    rows = [(0.0, 0.0, 0.0)] * 30
    comparison = compare_with_paper(dataset(cell('SMT', '1024', 'world', rows)))
    assert len(comparison.rows) == 12
    assert not any(row.is_evidence or row.is_contradicted for row in comparison.rows)


def test_a_family_is_corrected_for_its_own_cells_alone():
    rows = [(0.001 * number, 0.0, 0.1 * number) for number in range(30)]
    noisy = (('simulator.lidar.noise', '0.1'),)
    alone = compare_with_paper(dataset(cell('SL', '40', 'odom', rows))).rows
    among = compare_with_paper(
        dataset(
            cell('SL', '40', 'odom', rows),
            cell('SL', '40', 'odom', rows, varied=noisy),
            cell('SMT', '40', 'odom', rows),
        )
    ).rows
    assert [row.p_adjusted for row in among if row.paper.test == 'SL'] == 2 * [row.p_adjusted for row in alone]
    [tested] = [row for row in alone if (row.paper.quantity.name, row.paper.statistic) == ('y_m', 'pct_within')]
    assert tested.p_adjusted > tested.agreement.p_value


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
    assert not any(row.is_evidence for row in comparison.rows if row.is_calibrated)
