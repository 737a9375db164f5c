"""Encoders compared over equal trials: which pairs, and how many at once."""

import numpy as np

from diff_encoder_sim.analysis.encoder_comparison import Question, compare_pprs
from diff_encoder_sim.analysis.paired_statistics import holm
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome
from synthetic_trials import dataset_of, synthetic_dataset, trial_data

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
