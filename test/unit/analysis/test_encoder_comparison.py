"""Encoders compared over equal trials."""

import numpy as np
import pytest

from diff_encoder_sim.analysis.encoder_comparison import QUESTIONS, compare_encoders, difference_table, differences
from diff_encoder_sim.analysis.statistics import SIGNIFICANCE, holm
from trial_tables import cell, results_of, synthetic_results, trial

TRIALS = 30


def with_errors(errors_by_ppr):
    """Trials 1 to n of each PPR whose odometry has these errors in y [m]."""
    return [cell('SL', ppr, 'odom', [(0.0, y_m, 0.0) for y_m in errors]) for ppr, errors in errors_by_ppr.items()]


def drawn(std, seed=0, trials=TRIALS):
    return np.random.default_rng(seed).normal(0.0, std, trials)


def test_only_equal_trials_with_a_final_pose_are_compared():
    coarse, fine = with_errors({'40': drawn(0.3, 1), '90': drawn(0.3, 2, TRIALS + 5)})
    coarse[6]['odom_x_m'] = np.nan
    del fine[8]
    assert set(compare_encoders(results_of(fine[::-1], coarse))['pairs']) == {TRIALS - 2}
    assert compare_encoders(results_of(coarse)).empty


def test_tests_and_parameters_are_compared_within_themselves():
    compared = compare_encoders(synthetic_results(('SL', 'SMT'), ('40', '90', '1024'), 4, ('0', '0.1')))
    names = ['test', 'noise', 'source', 'question', 'error', 'ppr_a', 'ppr_b']
    assert len(compared) == len(compared[names].drop_duplicates()) == 2 * 2 * 4 * 3 * 3 * 3  # three pairs of encoders


def test_p_values_are_adjusted_for_all_of_equal_source_and_question_and_find_what_differs():
    compared = compare_encoders(synthetic_results())
    for _, family in compared.groupby(['source', 'question']):
        assert len(family) == 3 * 3 * 6  # tests, axes, pairs of PPRs
        assert family['p_holm'].tolist() == holm(family['p'].tolist())
    is_found = compared['p_holm'] < SIGNIFICANCE
    assert not is_found[compared['source'] == 'world'].any()
    far_apart = (compared['ppr_a'] + compared['ppr_b']).isin(['401024', '404096', '904096'])
    of_y = (compared['source'] == 'odom') & (compared['error'] == 'y_m') & (compared['question'] == 'spread')
    assert is_found[far_apart & of_y].all()


def test_an_encoder_that_is_worse_is_named_with_numbers():
    coarse, fine = drawn(0.3, 1), drawn(0.012, 2)
    ratio, shares = np.std(coarse) / np.std(fine), [np.mean(np.abs(one) <= 0.05) for one in (coarse, fine)]
    points = 100.0 * (shares[1] - shares[0])
    verdicts = {
        'spread': f'40 counts spreads more than 4096 counts (ratio {ratio:.3g}, 95 % interval 12.4 to 36)',
        'error': '40 counts has larger errors than 4096 counts (by 0.14 m, 95 % interval 0.094 to 0.2)',
        'within': f'4096 counts is within 0.05 m more often than 40 counts (by {points:.0f} percentage points, '
        '95 % interval 65 to 97)',
    }
    for given in ({'40': coarse, '4096': fine}, {'4096': fine, '40': coarse}):  # whichever comes first
        compared = compare_encoders(results_of(*with_errors(given)))
        of_y = compared[compared['error'] == 'y_m']
        assert dict(zip(of_y['question'], of_y['verdict'])) == verdicts


def test_comparisons_have_a_row_each():
    # Equal but for the factor -2: the ratio of spreads is 2 and the distances differ by 0.01 to 0.03.
    trials = [
        trial('SL', ppr, number, odom=(0.0, factor * 0.01 * number, 0.0), noise='0')
        for ppr, factor in (('40', -2.0), ('90', 1.0))
        for number in (1, 2, 3)
    ]
    found = compare_encoders(results_of(trials, varied=['noise'])).drop(columns=['p', 'setup']).to_dict('records')
    names = 'test,noise,source,question,error,ppr_a,ppr_b,pairs,estimate,low,high,p_holm,verdict'
    assert ','.join(found[0]) == names and len(found) == 9  # axes and questions of the one source
    estimates = {row['question']: float(row['estimate']) for row in found if row['error'] == 'y_m'}
    assert estimates == pytest.approx({'spread': 2.0, 'error': 0.02, 'within': -1.0 / 3.0})  # 0.06 m is beyond
    assert list(estimates) == list(QUESTIONS)
    assert {row['verdict'] for row in found} == {'40 counts and 90 counts are not distinguishable with 3 trials'}


def test_encoders_that_differ_are_named_worse_first():
    wide = np.array([0.1 * (-1) ** number * (1 + number % 5) for number in range(30)])
    compared = compare_encoders(results_of(*with_errors({'40': wide, '90': wide, '1024': 0.01 * wide})))
    different = differences(compared)
    [row] = difference_table(different).exact.values.tolist()
    assert row == ['SL', '/odom, y', *['40 than 1024; 90 than 1024'] * 3]
    assert different['verdict'].iloc[0].startswith('40 counts spreads more than 1024 ')
    assert difference_table(differences(compare_encoders(results_of(*with_errors({'40': wide}))))) is None
