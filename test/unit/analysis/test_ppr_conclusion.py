"""The comparison of two encoders as a sentence."""

import numpy as np
import pytest

from diff_encoder_sim.analysis.encoder_comparison import Question, compare_pprs, conclusion
from diff_encoder_sim.drives.topics import PoseSource
from synthetic_trials import dataset_of, trial_data

TRIALS = 30


def dataset_with(errors_by_ppr, source=PoseSource.ODOM, **other):
    """Trials 1 to n of each PPR with these errors in y [m], of one source only."""
    return dataset_of(
        trial_data('SL', ppr, number, {source: (0.0, float(error), 0.0)}, **other)
        for ppr, errors in errors_by_ppr.items()
        for number, error in enumerate(errors, 1)
    )


def y_conclusions(dataset):
    return {
        comparison.question: conclusion(comparison)
        for comparison in compare_pprs(dataset)
        if comparison.quantity.axis == 'y'
    }


def drawn(std, seed=0, trials=TRIALS):
    return np.random.default_rng(seed).normal(0.0, std, trials)


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


def test_a_finer_encoder_that_does_worse_is_named_first():
    coarse_is_worse = y_conclusions(dataset_with({'40': drawn(0.3, 1), '4096': drawn(0.012, 2)}))
    fine_is_worse = y_conclusions(dataset_with({'40': drawn(0.012, 2), '4096': drawn(0.3, 1)}))
    names = str.maketrans({'#': '40 PPR', '@': '4096 PPR'})
    assert fine_is_worse == {
        question: sentence.replace('4096 PPR', '#').replace('40 PPR', '@').translate(names)
        for question, sentence in coarse_is_worse.items()
    }


def test_encoders_that_differ_by_chance_are_not_distinguishable():
    conclusions = y_conclusions(dataset_with({'1024': drawn(0.02, 3), '4096': drawn(0.02, 4)}))
    assert set(conclusions.values()) == {'1024 PPR and 4096 PPR are not distinguishable with 30 trials'}


def test_an_encoder_without_any_spread():
    conclusions = y_conclusions(dataset_with({'40': drawn(0.02, 3), 'ideal': np.full(TRIALS, 0.1) + drawn(1e-15)}))
    assert conclusions[Question.SPREAD] == '40 PPR spreads, ideal odometry does not: all its 30 errors are equal'


@pytest.mark.parametrize('trials', [1, 2])
def test_too_few_trials_distinguish_nothing(trials):
    conclusions = y_conclusions(dataset_with({'40': drawn(1.0, 1, trials), '90': drawn(0.001, 2, trials)}))
    assert set(conclusions.values()) == {f'40 PPR and 90 PPR are not distinguishable with {trials} trials'}
