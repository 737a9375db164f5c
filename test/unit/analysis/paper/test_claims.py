"""The paper's claims, their parts and hypothesis tests."""

import functools

import numpy as np
import pytest
from scipy import stats

from diff_encoder_sim.analysis.paper import claims
from diff_encoder_sim.analysis.paper.claims import FAILS, HOLDS, UNCLEAR, Sample, concluded
from diff_encoder_sim.analysis.paper.comparison import PPRS
from diff_encoder_sim.analysis.quantities import YAW, X
from trial_tables import cell, results_of, trial

# The odometry's spread by PPR.
FALLING = {'40': 0.4, '90': 0.2, '1024': 0.02, '4096': 0.005}
FLAT = dict.fromkeys(PPRS, 0.1)
RISING = {'40': 0.005, '90': 0.02, '1024': 0.2, '4096': 0.4}
TURNED = dict.fromkeys(('odom', 'world', 'global'), (0.0, 0.0, 5.0))


def campaign(spread_of_odom=None, count=30, pprs=PPRS, tests=('SL', 'SMT', 'DLD'), **odd):
    """Rows with every pose in every cell, the odometry's spread by PPR; `odd` errors in every trial."""
    rng, made = np.random.default_rng(0), []
    for test in tests:
        for ppr in pprs:
            steady = rng.normal(0.0, 0.005, (count, 3)).tolist()
            of_odom = rng.normal(0.0, (spread_of_odom or FALLING)[ppr], (count, 3)).tolist()
            made += [
                trial(test, ppr, number, **{'odom': drifted, 'global': row, 'amcl': row, 'world': row, **odd})
                for number, (row, drifted) in enumerate(zip(steady, of_odom))
            ]
    return made


def claim_of(made, words):
    """What the trials show of the claim with these words."""
    found = claims.check_claims(results_of(made).trials.assign(campaign='a'))['a']
    [claim] = [claim for claim in found if words in claim.text]
    return claim


def changed(count, **values):
    """The campaign with values in the first of its trials."""
    made = campaign()
    for one in made[:count]:
        one.update(values)
    return made


@pytest.mark.parametrize(
    ('made', 'words', 'expected'),
    [
        (campaign(FALLING), 'steadier odometry', 'reproduced'),
        (campaign(FLAT), 'steadier odometry', 'not contradicted'),
        (campaign(RISING), 'steadier odometry', 'contradicted'),
        (campaign(), 'By AMCL', 'reproduced'),
        (changed(1, global_x_m=0.06), 'By AMCL', 'not contradicted'),
        (changed(12, global_x_m=0.06), 'By AMCL', 'contradicted'),
        (campaign(pprs=PPRS[:2], **TURNED) + campaign(pprs=PPRS[2:]), 'The heading is within 3', 'reproduced'),
        (campaign(), 'The heading is within 3', 'contradicted'),
        (campaign(), '/amcl_pose and', 'reproduced'),
        (campaign(amcl=(0.0, 0.0, 20.0)), '/amcl_pose and', 'contradicted'),
        # The long way round is no difference.
        (campaign(amcl=(0, 0, -179.9), **{'global': (0, 0, 179.9)}), '/amcl_pose and', 'reproduced'),
        (campaign(), 'completes every route', 'reproduced'),
        (changed(1, outcome='collision'), 'completes every route', 'not contradicted'),
        (changed(11, outcome='collision'), 'completes every route', 'contradicted'),
    ],
)
def test_a_claim_is_judged_by_all_its_parts(made, words, expected):
    assert claim_of(made, words).conclusion == expected


def test_what_is_missing_is_not_tested():
    few = campaign(tests=('SL',), pprs=('40', '90'), count=5)
    assert claim_of(few, 'steadier odometry').conclusion == 'not tested: too few trials'
    poor = claim_of(few, 'Odometry is poor')
    assert (poor.conclusion, poor.p_text) == ('not tested: too few trials', '')
    assert 'too few trials' in poor.parts[0].text and poor.counts.startswith('unclear ')


def test_every_trial_is_fishers_test_with_the_papers_own_trials():
    trials = results_of(cell('SL', '40', 'odom', [(0.0, 0.0, 0.0)] * 30)).trials
    [test] = claims.every_trial('within', trials, lambda part: part['trial'] > 5)
    assert test.p_value == pytest.approx(stats.fisher_exact([[25, 5], [30, 0]])[1])
    assert test.text.startswith('SL at 40 PPR: 25 of 30 within, the paper 30 of 30, p 0.05')


def conclusions(judge, *samples):
    return [part.conclusion for part in concluded(judge(sample) for sample in samples)]


# Thirty values: the 95 % interval of their spread of 1 is 0.796 to 1.344; 26 within, of which Wilson's is 0.70 to 0.95.
EVEN = np.linspace(-1.0, 1.0, 30) / np.linspace(-1.0, 1.0, 30).std(ddof=1)
MOSTLY = np.array([0.0] * 26 + [9.0] * 4)


@pytest.mark.parametrize(
    ('judge', 'values', 'limits'),
    [(claims.spread, EVEN, (0.79, 0.81, 1.35)), (claims.fraction_within, MOSTLY, (0.69, 0.72, 0.96))],
)
def test_a_value_against_a_limit(judge, values, limits):
    sample, single = Sample('', YAW, (values,)), Sample('', YAW, (values[:1],))
    judges = [functools.partial(judge, limit=limit) for limit in limits]
    assert [conclusions(each, sample) for each in judges] == [[HOLDS], [UNCLEAR], [FAILS]]
    assert conclusions(functools.partial(judges[-1], sign=-1), sample) == [HOLDS]
    assert conclusions(judges[-1], single) == [UNCLEAR]


def test_failing_must_be_sure_for_all_parts_together():
    judge, sample = functools.partial(claims.spread, limit=1.36), Sample('', YAW, (EVEN,))
    assert conclusions(judge, sample) == [FAILS]
    assert conclusions(judge, *20 * [sample]) == 20 * [UNCLEAR]


def pair(first, second):
    return Sample('a pair', X, (np.asarray(first), np.asarray(second)), ('40 PPR', '4096 PPR'))


def test_equal_fractions():
    inside, outside = np.zeros(30), np.ones(30)
    pairs = [(inside, inside), (inside, outside), (inside[:10], inside[:10]), ([], [])]
    found = [conclusions(claims.fractions_equal, pair(*one)) for one in pairs]
    assert found == [[HOLDS], [FAILS], [UNCLEAR], [UNCLEAR]]


@pytest.mark.parametrize('compared', [claims.SPREAD, claims.SIZE])
def test_spreads_and_sizes_of_pairs(compared):
    judge = functools.partial(claims.first_is_larger, compared=compared)
    wide, narrow, other = (np.random.default_rng(seed).normal(0.0, std, 30) for seed, std in ((1, 3), (2, 1), (3, 3)))
    pairs = [(wide, narrow), (narrow, wide), (wide, other), (wide[:2], narrow[:2])]
    assert [conclusions(judge, pair(*one)) for one in pairs] == [[HOLDS], [FAILS], [UNCLEAR], [UNCLEAR]]


def test_pairs_are_of_equal_trials():
    first = cell('SL', '40', 'odom', [(1.0, 0.0, 0.0), (2.0, 0.0, 0.0), (3.0, 0.0, 0.0)])
    second = cell('SL', '4096', 'odom', [(0.1, 0.0, 0.0), (0.2, 0.0, 0.0)])
    second[0]['odom_x_m'] = np.nan
    [one] = claims.pairs_of_pprs(results_of(first, second).trials, 'odom', ['SL'], [('40', '4096')], [X])
    assert [values.tolist() for values in one.values] == [[2.0], [0.2]]
