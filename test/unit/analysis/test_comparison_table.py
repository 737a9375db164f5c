"""All comparisons as a table."""

import pytest

from diff_encoder_sim.analysis.encoder_comparison import compare_pprs, comparison_table, conclusion
from diff_encoder_sim.drives.topics import PoseSource
from synthetic_trials import dataset_of, synthetic_dataset, trial_data
from table_records import records


def compared_records(dataset):
    return records(comparison_table(dataset, compare_pprs(dataset)))


def test_comparisons_have_a_row_each():
    # Equal but for the factor -2: the ratio of spreads is 2 and the distances differ by 0.01 to 0.03.
    trials = [
        trial_data('SL', ppr, number, {PoseSource.ODOM: (0.0, factor * 0.01 * number, 0.0)}, varied=(('noise', '0'),))
        for ppr, factor in (('40', -2.0), ('90', 1.0))
        for number in (1, 2, 3)
    ]
    rows = compared_records(dataset_of(trials))
    assert len(rows) == 9  # axes and questions of the one source
    spread, error, within = (row for row in rows if row['error'] == 'y_m')
    assert [row['question'] for row in (spread, error, within)] == ['spread', 'error', 'within']
    assert list(spread.values())[:8] == ['SL', '0', 'odom', 'spread', 'y_m', '40', '90', '3']
    assert float(spread['estimate']) == pytest.approx(2.0)
    assert float(error['estimate']) == pytest.approx(0.02)
    assert float(within['estimate']) == pytest.approx(-1.0 / 3.0)  # 0.06 m is beyond
    assert {row['verdict'] for row in rows} == {'40 PPR and 90 PPR are not distinguishable with 3 trials'}


def test_conclusions_are_those_of_the_comparisons():
    dataset = synthetic_dataset(tests=('SL',), trials=30)
    rows, compared = compared_records(dataset), compare_pprs(dataset)
    assert [(float(row['p_holm']), row['verdict']) for row in rows] == [
        (one.p_adjusted, conclusion(one)) for one in compared
    ]
    assert all(float(row['low']) <= float(row['estimate']) <= float(row['high']) for row in rows)


def test_comparisons_are_of_every_two_encoders():
    rows = compared_records(synthetic_dataset(tests=('SL',), trials=3))
    assert ','.join(rows[0]) == 'test,source,question,error,ppr_a,ppr_b,pairs,estimate,low,high,p_holm,verdict'
    assert len(rows) == 6 * 4 * 3 * 3  # pairs of encoders, sources, axes, questions
