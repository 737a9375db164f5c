"""Encoders compared over equal trials."""

import numpy as np
import pytest

from diff_encoder_sim.analysis.encoder_comparison import (
    Question,
    compare_encoders,
    compare_pprs,
    comparison_table,
    conclusion,
)
from diff_encoder_sim.analysis.statistics import holm
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome
from paper_datasets import cell, dataset
from synthetic_trials import dataset_of, synthetic_dataset, trial_data
from table_records import records

TRIALS = 30


def dataset_with(errors_by_ppr, source=PoseSource.ODOM, **other):
    """Trials 1 to n of each PPR with these errors in y [m], of one source only."""
    return dataset_of(
        trial_data('SL', ppr, number, {source: (0.0, float(error), 0.0)}, **other)
        for ppr, errors in errors_by_ppr.items()
        for number, error in enumerate(errors, 1)
    )


def drawn(std, seed=0, trials=TRIALS):
    return np.random.default_rng(seed).normal(0.0, std, trials)


def test_only_equal_trials_with_a_final_pose_are_compared():
    dataset = dataset_with({'40': drawn(0.3, 1), '90': drawn(0.3, 2, TRIALS + 5)})
    trials = [
        trial._replace(outcome=Outcome.TORN) if (trial.ppr, trial.trial) == ('40', 7) else trial
        for trial in dataset.trials
        if (trial.ppr, trial.trial) != ('90', 9)
    ]
    assert {one.result.pairs for one in compare_pprs(dataset_of(reversed(trials)))} == {TRIALS - 2}
    assert compare_pprs(dataset_of(trials[:3])) == [] and compare_pprs(dataset_of([])) == []


def test_tests_and_parameters_are_compared_within_themselves():
    variants = ((('slip', '0'),), (('slip', '0.1'),))
    compared = compare_pprs(synthetic_dataset(('SL', 'SMT'), ('40', '90', '1024'), 4, variants))
    cells = {(one.test, one.varied, one.pprs) for one in compared}
    assert cells == {
        (test, varied, pprs)
        for test in ('SL', 'SMT')
        for varied in variants
        for pprs in (('40', '90'), ('40', '1024'), ('90', '1024'))
    }
    assert len(compared) == len(cells) * 4 * 3 * 3  # sources, axes, questions


def test_p_values_are_adjusted_for_all_of_equal_source_and_question():
    compared = compare_pprs(synthetic_dataset())
    for source in (PoseSource.ODOM, PoseSource.WORLD):
        for question in Question:
            family = [one for one in compared if (one.source, one.question) == (source, question)]
            assert len(family) == 3 * 3 * 6  # tests, axes, pairs of PPRs
            assert [one.p_adjusted for one in family] == holm([one.result.p_value for one in family])


def test_where_the_encoder_does_not_matter_nothing_is_found_and_where_it_does_all_is():
    compared = compare_pprs(synthetic_dataset())
    assert not any(one.is_distinguishable for one in compared if one.source == PoseSource.WORLD)
    across_the_drive = [
        one
        for one in compared
        if one.source == PoseSource.ODOM
        and one.quantity.axis == 'y'
        and one.pprs in (('40', '1024'), ('40', '4096'), ('90', '4096'))
    ]
    assert all(one.is_distinguishable for one in across_the_drive if one.question is Question.SPREAD)


def y_conclusions(dataset):
    return {
        comparison.question: conclusion(comparison)
        for comparison in compare_pprs(dataset)
        if comparison.quantity.axis == 'y'
    }


def test_an_encoder_that_is_worse_is_named_with_numbers():
    coarse, fine = drawn(0.3, 1), drawn(0.012, 2)
    conclusions = y_conclusions(dataset_with({'40': coarse, '4096': fine}))
    ratio = np.std(coarse) / np.std(fine)
    points = 100.0 * (np.mean(np.abs(fine) <= 0.05) - np.mean(np.abs(coarse) <= 0.05))
    assert conclusions == {
        Question.SPREAD: f'40 PPR spreads more than 4096 PPR (ratio {ratio:.3g}, 95 % interval 12.4 to 36)',
        Question.ERROR: '40 PPR has larger errors than 4096 PPR (by 0.14 m, 95 % interval 0.094 to 0.2)',
        Question.WITHIN: f'4096 PPR is within 0.05 m more often than 40 PPR (by {points:.0f} percentage points, '
        '95 % interval 65 to 97)',
    }


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


def test_comparisons_are_of_every_two_encoders():
    rows = compared_records(synthetic_dataset(tests=('SL',), trials=3))
    assert ','.join(rows[0]) == 'test,source,question,error,ppr_a,ppr_b,pairs,estimate,low,high,p_holm,verdict'
    assert len(rows) == 6 * 4 * 3 * 3  # pairs of encoders, sources, axes, questions


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
