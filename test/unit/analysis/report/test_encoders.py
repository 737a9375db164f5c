"""The section that compares encoders."""

from diff_encoder_sim.analysis.encoder_comparison import compare_encoders, compare_pprs
from paper_datasets import IN, OUT, TURNED, cell, dataset


def test_encoders_that_differ_are_named_worse_first():
    wide = [(0.0, 0.1 * (-1) ** number * (1 + number % 5), 0.0) for number in range(30)]
    narrow = [(x, 0.01 * y, yaw) for x, y, yaw in wide]
    comparison = compare_encoders(
        compare_pprs(
            dataset(cell('SL', '40', 'odom', wide), cell('SL', '90', 'odom', wide), cell('SL', '1024', 'odom', narrow))
        )
    )
    assert comparison.table.rows == [['SL', '/odom, y', *['40 than 1024; 90 than 1024'] * 3]]
    assert [sentence[:40] for sentence in comparison.conclusions['SL']][:1] == [
        '/odom, y: 40 PPR spreads more than 1024 '
    ]
    assert comparison.comparisons == 3 * 3 * 3  # pairs, axes, questions of the one source


def test_equal_encoders_do_not_differ():
    comparison = compare_encoders(
        compare_pprs(dataset(cell('SL', '40', 'odom', [IN, OUT, TURNED]), cell('SL', '90', 'odom', [IN, OUT, TURNED])))
    )
    assert comparison.table is None and not comparison.conclusions and comparison.comparisons == 9
