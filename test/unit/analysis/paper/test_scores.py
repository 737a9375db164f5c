"""Counts of cells that agree, and which of two readings fits better, by cells made by hand."""

import pytest

from diff_encoder_sim.analysis.paired_statistics import mcnemar
from diff_encoder_sim.analysis.paper.comparison import better_fit, compare_with_paper, score, scores_by_family
from diff_encoder_sim.analysis.paper.paper_cells import load_paper_cells
from diff_encoder_sim.drives.topics import PoseSource
from paper_datasets import cell, dataset


def compared(scale=1.0, tests=('SL', 'SMT', 'DLD'), sources=('odom',)):
    """Thirty trials of each cell, evenly between the paper's extremes times a scale."""
    printed = {
        (one.source.value, one.test, one.ppr, one.quantity.name, one.statistic): one.value for one in load_paper_cells()
    }
    cells = []
    for source in sources:
        for test in tests:
            for ppr in ('40', '90', '1024', '4096'):
                ends = [
                    [scale * printed[source, test, ppr, name, statistic] for statistic in ('min', 'max')]
                    for name in ('x_m', 'y_m', 'yaw_deg')
                ]
                rows = [tuple(low + (high - low) * number / 29 for low, high in ends) for number in range(30)]
                cells.append(cell(test, ppr, source, rows))
    return compare_with_paper(dataset(*cells)).rows


def test_the_papers_own_extremes_agree():
    rows = [one for one in compared() if one.paper.statistic in ('min', 'max')]
    total = score(rows)
    assert total.compared == total.inside == total.alone == total.in_family
    assert total.compared == 72 - 1 - 2  # the maximum of one trial 80 degrees off, and what was fitted to


def test_scores_are_by_source_and_test():
    scores = scores_by_family(compared(sources=('world', 'odom'), tests=('SMT', 'SL')))
    assert list(scores) == [(source, test) for source in (PoseSource.ODOM, PoseSource.WORLD) for test in ('SL', 'SMT')]
    assert scores[PoseSource.WORLD, 'SMT'].compared == 48 - 12 - 2  # without the column that is printed twice


def test_a_family_is_more_forgiving_than_each_cell_alone():
    total = score(compared(scale=1.5))
    assert total.alone < total.in_family < total.compared


def test_a_reading_that_is_nearer_fits_better():
    near, far = compared(), compared(scale=6.0)
    fit = better_fit(near, far)
    first = [one.agreement.p_value >= 0.05 for one in near if one.is_evidence]
    second = [one.agreement.p_value >= 0.05 for one in far if one.is_evidence]
    assert fit.only[0] > 20 * fit.only[1] and fit.mcnemar_p == pytest.approx(mcnemar(first, second).p_value)
    assert fit.grouped_p == pytest.approx(2.0**-11)  # all twelve groups favour the first
    assert better_fit(far, near).only == fit.only[::-1]


def test_equal_readings_and_readings_without_a_common_cell_do_not_differ():
    near = compared()
    assert better_fit(near, near) == ((0, 0), 1.0, 1.0)
    assert better_fit(compared(tests=['SL']), compared(tests=['DLD'])) == ((0, 0), 1.0, 1.0)
