"""The rows of the summary."""

from diff_encoder_sim.analysis.report.headline import summary_rows
from diff_encoder_sim.analysis.within_tolerance import COMPARED_POSES
from paper_datasets import IN, cell, dataset


def test_the_summary_has_a_row_for_each_test_and_final_pose():
    rows_of = summary_rows(dataset(cell('SL', '40', 'odom', [IN]), cell('SMT', '90', 'odom', [IN])))
    assert [(row.test, row.pose, list(row.fractions)) for row in rows_of] == [
        (test, pose, [ppr]) for test, ppr in (('SL', '40'), ('SMT', '90')) for pose in COMPARED_POSES
    ]


def test_encoders_are_in_the_order_of_their_pulses_also_where_the_first_test_has_not_all():
    rows_of = summary_rows(
        dataset(cell('SL', '90', 'odom', [IN]), cell('SMT', '40', 'odom', [IN]), cell('SMT', '90', 'odom', [IN]))
    )
    assert [list(row.fractions) for row in rows_of if row.pose is COMPARED_POSES[-1]] == [['90'], ['40', '90']]
