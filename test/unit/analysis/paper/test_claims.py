"""The paper's claims, their parts and hypothesis tests."""

import numpy as np
import pytest
from scipy import stats

from diff_encoder_sim.analysis.paper.claims import (
    CLAIMS,
    FAILS,
    HOLDS,
    UNCLEAR,
    Errors,
    all_within,
    check_claims,
    claim_conclusion,
    first_spreads_more,
    fractions_equal,
    pairs_of_pprs,
    spreads,
)
from diff_encoder_sim.analysis.paper.paper_cells import PPRS, load_claims
from diff_encoder_sim.analysis.quantities import YAW, X
from trial_tables import IN, OUT, cell, results_of, trial

# The odometry's spread by PPR.
FALLING = {'40': 0.4, '90': 0.2, '1024': 0.02, '4096': 0.005}
FLAT = dict.fromkeys(PPRS, 0.1)
RISING = {'40': 0.005, '90': 0.02, '1024': 0.2, '4096': 0.4}


def campaign(spread_of_odom, count=30, seed=0, pprs=PPRS, tests=('SL', 'SMT', 'DLD'), **odd):
    """Rows with every pose in every cell, the odometry's spread by PPR; `odd` errors in every trial."""
    rng, made = np.random.default_rng(seed), []
    for test in tests:
        for ppr in pprs:
            steady = rng.normal(0.0, 0.005, (count, 3)).tolist()
            of_odom = rng.normal(0.0, spread_of_odom[ppr], (count, 3)).tolist()
            made += [
                trial(test, ppr, number, **{'odom': drifted, 'global': row, 'amcl': row, 'world': row, **odd})
                for number, (row, drifted) in enumerate(zip(steady, of_odom))
            ]
    return made


def conclusion_of(made, words):
    """What the trials show of the claim with these words."""
    (claim,) = [claim for claim in load_claims() if words in claim['text']]
    return claim_conclusion(CLAIMS[claim['key']](results_of(made).trials))


@pytest.mark.parametrize(
    ('spreads_of_odom', 'expected'), [(FALLING, 'reproduced'), (FLAT, 'not contradicted'), (RISING, 'contradicted')]
)
def test_steadier_odometry_with_a_higher_resolution(spreads_of_odom, expected):
    assert conclusion_of(campaign(spreads_of_odom), 'steadier odometry') == expected


def test_amcl_within_tolerance_is_contradicted_by_many_trials_not_by_one():
    made = campaign(FALLING)
    assert conclusion_of(made, 'By AMCL') == 'reproduced'
    made[7]['global_x_m'] = 0.06
    assert conclusion_of(made, 'By AMCL') == 'not contradicted'
    for one in made[:12]:
        one['global_x_m'] = 0.06
    assert conclusion_of(made, 'By AMCL') == 'contradicted'


def test_heading_within_three_degrees_by_resolution():
    turned = {'odom': (0.0, 0.0, 5.0), 'world': (0.0, 0.0, 5.0), 'global': (0.0, 0.0, 5.0)}
    coarse = campaign(FALLING, pprs=PPRS[:2], **turned)
    fine = campaign(FALLING, pprs=PPRS[2:])
    assert conclusion_of(coarse + fine, 'The heading is within 3') == 'reproduced'
    assert conclusion_of(campaign(FALLING), 'The heading is within 3') == 'contradicted'


def test_what_is_missing_is_not_tested():
    few = campaign(FALLING, tests=('SL',), pprs=('40', '90'), count=5)
    assert conclusion_of(few, 'steadier odometry') == 'not tested: too few trials'
    assert conclusion_of(few, 'Odometry is poor') == 'not tested: too few trials'
    (result,) = [one for one in check_claims(results_of(few), 'a')['a'] if 'Odometry is poor' in one.text]
    assert 'too few trials' in result.tests[0].text and result.p_text == ''


def test_amcl_and_global_pose_agree_or_not():
    assert conclusion_of(campaign(FALLING), '/amcl_pose and') == 'reproduced'
    stale = campaign(FALLING, amcl=(0.0, 0.0, 20.0))
    assert conclusion_of(stale, '/amcl_pose and') == 'contradicted'
    # The long way round is no difference.
    turned = campaign(FALLING, amcl=(0.0, 0.0, -179.9), **{'global': (0.0, 0.0, 179.9)})
    assert conclusion_of(turned, '/amcl_pose and') == 'reproduced'


def failing(made, numbers):
    """The campaign with these of its trials failed."""
    for number in numbers:
        made[number]['outcome'] = 'collision'
    return conclusion_of(made, 'completes every route')


def test_one_of_thirty_trials_is_no_evidence_and_eleven_of_one_cell_are():
    assert failing(campaign(FALLING), []) == 'reproduced'
    assert failing(campaign(FALLING), [3]) == 'not contradicted'
    assert failing(campaign(FALLING), range(11)) == 'contradicted'


def test_the_test_is_fishers_with_the_papers_own_trials():
    trials = results_of(cell('SL', '40', 'global', [IN] * 25 + [OUT] * 5)).trials
    [test] = all_within(trials, 'global', ['SL'], ['40'])
    assert test.p_against == pytest.approx(stats.fisher_exact([[25, 5], [30, 0]])[1])
    assert test.text.startswith('SL at 40 PPR: 25 of 30 within, the paper 30 of 30, p 0.05')


def conclusions(tests):
    return [test.conclusion for test in tests]


def exact(count, spread):
    """Values of exactly this standard deviation."""
    values = np.linspace(-1.0, 1.0, count)
    return spread * values / values.std(ddof=1)


def test_spread_against_a_limit():
    # Thirty values: the 95 % interval of a spread of 1 is 0.796 to 1.344.
    one = [Errors('', YAW, (exact(30, 1.0),))]
    assert conclusions(spreads(0.79, above=one)) == [HOLDS]
    assert conclusions(spreads(0.81, above=one)) == [UNCLEAR]
    assert conclusions(spreads(1.35, above=one)) == [FAILS]
    assert conclusions(spreads(1.35, below=one)) == [HOLDS]
    assert conclusions(spreads(0.79, below=one)) == [FAILS]
    assert conclusions(spreads(1.0, below=[Errors('', YAW, (np.array([0.5]),))])) == [UNCLEAR]


def normal(count, spread=1.0, mean=0.0, seed=0):
    return np.random.default_rng(seed).normal(mean, spread, count)


def pair(first, second, quantity=X):
    return Errors('a pair', quantity, (np.asarray(first), np.asarray(second)), ('40 PPR', '4096 PPR'))


def test_equal_fractions():
    inside, outside = np.zeros(30), np.ones(30)
    assert conclusions(fractions_equal([pair(inside, inside)])) == [HOLDS]
    assert conclusions(fractions_equal([pair(inside, outside)])) == [FAILS]
    assert conclusions(fractions_equal([pair(inside[:10], inside[:10])])) == [UNCLEAR]
    assert conclusions(fractions_equal([pair([], [])])) == [UNCLEAR]


def test_pairs_are_of_equal_trials():
    first = cell('SL', '40', 'odom', [(1.0, 0.0, 0.0), (2.0, 0.0, 0.0), (3.0, 0.0, 0.0)])
    second = cell('SL', '4096', 'odom', [(0.1, 0.0, 0.0), (0.2, 0.0, 0.0)])
    second[0]['odom_x_m'] = np.nan
    (one,) = pairs_of_pprs(results_of(first, second).trials, 'odom', ['SL'], [('40', '4096')], [X])
    assert [values.tolist() for values in one.values] == [[2.0], [0.2]]


def test_failing_must_be_sure_for_all_parts_together():
    samples = [Errors('', YAW, (exact(30, 1.0),))]
    assert conclusions(spreads(1.36, above=samples)) == [FAILS]
    assert conclusions(spreads(1.36, above=20 * samples)) == 20 * [UNCLEAR]


def test_spreads_of_pairs():
    wide, narrow = normal(30, 3.0, seed=1), normal(30, 1.0, seed=2)
    assert conclusions(first_spreads_more([pair(wide, narrow)])) == [HOLDS]
    assert conclusions(first_spreads_more([pair(narrow, wide)])) == [FAILS]
    assert conclusions(first_spreads_more([pair(wide, normal(30, 3.0, seed=3))])) == [UNCLEAR]
    assert conclusions(first_spreads_more([pair(wide[:2], narrow[:2])])) == [UNCLEAR]
