"""The paper's claims on datasets made to reproduce, refute or leave each of them open."""

import numpy as np
import pytest

from diff_encoder_sim.analysis.paper.claim_results import check_claims, claim_conclusion
from diff_encoder_sim.analysis.paper.claim_samples import Pair, Sample, pairs_of_pprs
from diff_encoder_sim.analysis.paper.claims import CLAIMS
from diff_encoder_sim.analysis.paper.hypothesis_tests import Conclusion, HypothesisTest
from diff_encoder_sim.analysis.paper.limit_tests import all_within, fractions_within, spreads
from diff_encoder_sim.analysis.paper.paired_tests import first_errs_more, first_spreads_more, fractions_equal
from diff_encoder_sim.analysis.quantities import YAW, X
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.trials.pose_source import PoseSource
from diff_encoder_sim.trials.trial_outcome import Outcome
from paper_datasets import cell, dataset, trial

HOLDS, FAILS, UNCLEAR = Conclusion.HOLDS, Conclusion.FAILS, Conclusion.UNCLEAR
PPRS = ('40', '90', '1024', '4096')


def conclusions(tests):
    return [test.conclusion for test in tests]


def normal(count, spread=1.0, mean=0.0, seed=0):
    return np.random.default_rng(seed).normal(mean, spread, count)


def exact(count, spread):
    """Values of exactly this standard deviation."""
    values = np.linspace(-1.0, 1.0, count)
    return spread * values / values.std(ddof=1)


def pair(first, second, quantity=X):
    return Pair('a pair', ('40 PPR', '4096 PPR'), (np.asarray(first), np.asarray(second)), quantity)


# ---- verdicts


@pytest.mark.parametrize(
    ('parts', 'expected'),
    [
        ([HOLDS, HOLDS], 'reproduced'),
        ([HOLDS, FAILS, UNCLEAR], 'not reproduced'),
        ([HOLDS, UNCLEAR], 'not decidable with 30 trials'),
        ([], 'not decidable with 30 trials'),
    ],
)
def test_the_conclusion_of_parts(parts, expected):
    assert claim_conclusion([HypothesisTest(part, '') for part in parts], 30) == expected


# ---- kinds of evidence


def test_spread_against_a_limit():
    # Thirty values: the 95 % interval of a spread of 1 is 0.796 to 1.344.
    one = [Sample('', exact(30, 1.0), YAW)]
    assert conclusions(spreads(0.79, above=one)) == [HOLDS]
    assert conclusions(spreads(0.81, above=one)) == [UNCLEAR]
    assert conclusions(spreads(1.35, above=one)) == [FAILS]
    assert conclusions(spreads(1.35, below=one)) == [HOLDS]
    assert conclusions(spreads(0.79, below=one)) == [FAILS]
    assert conclusions(spreads(1.0, below=[Sample('', np.array([0.5]), YAW)])) == [UNCLEAR]


def test_failing_must_be_sure_for_all_parts_together():
    samples = [Sample('', exact(30, 1.0), YAW)]
    assert conclusions(spreads(1.36, above=samples)) == [FAILS]
    assert conclusions(spreads(1.36, above=20 * samples)) == 20 * [UNCLEAR]


def test_fraction_against_a_limit():
    # 30 of 30: 88.6 to 100 per cent.
    all_of_them = [Sample('', np.zeros(30), X)]
    assert conclusions(fractions_within(0.88, above=all_of_them)) == [HOLDS]
    assert conclusions(fractions_within(0.89, above=all_of_them)) == [UNCLEAR]
    assert conclusions(fractions_within(0.88, below=all_of_them)) == [FAILS]
    assert '30 of 30 within, 89 to 100 per cent' in fractions_within(0.9, above=all_of_them)[0].text


def test_all_within_needs_every_trial():
    assert conclusions(all_within([Sample('', np.array([0.05, -0.05]), X)])) == [HOLDS]
    assert conclusions(all_within([Sample('', np.array([0.05, -0.051]), X)])) == [FAILS]
    assert conclusions(all_within([Sample('', np.array([]), X)])) == [UNCLEAR]


def test_spreads_of_pairs():
    wide, narrow = normal(30, 3.0, seed=1), normal(30, 1.0, seed=2)
    assert conclusions(first_spreads_more([pair(wide, narrow)])) == [HOLDS]
    assert conclusions(first_spreads_more([pair(narrow, wide)])) == [FAILS]
    assert conclusions(first_spreads_more([pair(wide, normal(30, 3.0, seed=3))])) == [UNCLEAR]
    assert conclusions(first_spreads_more([pair(wide[:2], narrow[:2])])) == [UNCLEAR]


def test_sizes_of_pairs():
    far, near = normal(30, 0.1, mean=1.0, seed=1), normal(30, 0.1, mean=0.5, seed=2)
    assert conclusions(first_errs_more([pair(-far, near)])) == [HOLDS]
    assert conclusions(first_errs_more([pair(near, far)])) == [FAILS]
    assert conclusions(first_errs_more([pair(near, normal(30, 0.1, 0.5, seed=3))])) == [UNCLEAR]


def test_equal_fractions():
    inside, outside = np.zeros(30), np.ones(30)
    assert conclusions(fractions_equal([pair(inside, inside)])) == [HOLDS]
    assert conclusions(fractions_equal([pair(inside, outside)])) == [FAILS]
    assert conclusions(fractions_equal([pair(inside[:10], inside[:10])])) == [UNCLEAR]
    assert conclusions(fractions_equal([pair([], [])])) == [UNCLEAR]


def test_pairs_are_of_equal_trials():
    first = cell('SL', '40', 'odom', [(1.0, 0.0, 0.0), (2.0, 0.0, 0.0), (3.0, 0.0, 0.0)])
    second = cell('SL', '4096', 'odom', [(0.1, 0.0, 0.0), (0.2, 0.0, 0.0)])
    second[0] = second[0]._replace(outcome=Outcome.TORN)
    (one,) = pairs_of_pprs(
        {('SL', '40'): first, ('SL', '4096'): second}, PoseSource.ODOM, ['SL'], [('40', '4096')], [X]
    )
    assert [values.tolist() for values in one.values] == [[2.0], [0.2]]


# ---- claims on whole datasets


def campaign(spread_of_odom, count=30, seed=0, pprs=PPRS, tests=('SL', 'SMT', 'DLD'), **odd):
    """Every source of every cell, the odometry's spread by PPR; `odd` errors in every trial."""
    rng, cells = np.random.default_rng(seed), []
    for test in tests:
        for ppr in pprs:
            steady = rng.normal(0.0, 0.005, (count, 3))
            of_odom = rng.normal(0.0, spread_of_odom[ppr], (count, 3))
            cells.append(
                [
                    trial(
                        test,
                        ppr,
                        number,
                        **{
                            'odom': tuple(drifted),
                            'global': tuple(row),
                            'amcl': tuple(row),
                            'world': tuple(row),
                            **odd,
                        },
                    )
                    for number, (row, drifted) in enumerate(zip(steady.tolist(), of_odom.tolist()))
                ]
            )
    return dataset(*cells)


def conclusion_of(made, words):
    (claim,) = [claim for claim in CLAIMS if words in claim.text]
    trials = {(cell.test, cell.ppr): of_cell for cell, of_cell in made.cells().items()}
    return claim_conclusion(claim.test(trials), max(map(len, trials.values())))


FALLING = {'40': 0.4, '90': 0.2, '1024': 0.02, '4096': 0.005}
FLAT = dict.fromkeys(PPRS, 0.1)
RISING = {'40': 0.005, '90': 0.02, '1024': 0.2, '4096': 0.4}


@pytest.mark.parametrize(
    ('spreads_of_odom', 'expected'),
    [(FALLING, 'reproduced'), (FLAT, 'not decidable with 30 trials'), (RISING, 'not reproduced')],
)
def test_steadier_odometry_with_a_higher_resolution(spreads_of_odom, expected):
    assert conclusion_of(campaign(spreads_of_odom), 'steadier odometry') == expected


@pytest.mark.parametrize(
    ('spreads_of_odom', 'expected'),
    [
        (dict.fromkeys(PPRS, 0.2), 'reproduced'),
        (FLAT, 'reproduced'),
        (dict.fromkeys(PPRS, 0.05), 'not decidable with 30 trials'),
        (FALLING, 'not reproduced'),
    ],
)
def test_poor_odometry_in_the_long_drive(spreads_of_odom, expected):
    assert conclusion_of(campaign(spreads_of_odom), 'Odometry is poor') == expected


def test_amcl_within_tolerance_is_refuted_by_one_trial():
    made = campaign(FALLING)
    assert conclusion_of(made, 'By AMCL') == 'reproduced'
    made.trials[7].errors[PoseSource.GLOBAL] = Pose2D(0.06, 0.0, 0.0)
    assert conclusion_of(made, 'By AMCL') == 'not reproduced'


def test_amcl_and_global_pose_agree_or_not():
    assert conclusion_of(campaign(FALLING), '/amcl_pose and') == 'reproduced'
    stale = campaign(FALLING, amcl=(0.0, 0.0, 20.0))
    assert conclusion_of(stale, '/amcl_pose and') == 'not reproduced'
    # The long way round is no difference.
    turned = campaign(FALLING, amcl=(0.0, 0.0, -179.9), **{'global': (0.0, 0.0, 179.9)})
    assert conclusion_of(turned, '/amcl_pose and') == 'reproduced'


def test_every_route_is_completed_or_not():
    made = campaign(FALLING)
    assert conclusion_of(made, 'completes every route') == 'reproduced'
    made.trials[3] = made.trials[3]._replace(outcome=Outcome.COLLISION)
    assert conclusion_of(made, 'completes every route') == 'not reproduced'


def test_heading_within_three_degrees_by_resolution():
    turned = {'odom': (0.0, 0.0, 5.0), 'world': (0.0, 0.0, 5.0), 'global': (0.0, 0.0, 5.0)}
    coarse = campaign(FALLING, pprs=PPRS[:2], **turned)
    fine = campaign(FALLING, pprs=PPRS[2:])
    as_claimed = fine._replace(trials=coarse.trials + fine.trials)
    assert conclusion_of(as_claimed, 'The heading is within 3') == 'reproduced'
    assert conclusion_of(campaign(FALLING), 'The heading is within 3') == 'not reproduced'


def test_what_is_missing_is_not_decided():
    few = campaign(FALLING, tests=('SL',), pprs=('40', '90'), count=5)
    assert conclusion_of(few, 'steadier odometry') == 'not decidable with 5 trials'
    assert conclusion_of(few, 'Odometry is poor') == 'not decidable with 5 trials'
    (result,) = [one for one in check_claims(few) if 'Odometry is poor' in one.text]
    assert 'too few trials' in result.tests[0].text


def test_every_claim_is_tested_for_each_set_of_parameters():
    noisy = (('simulator.lidar.noise', '0.1'),)
    made = campaign(FALLING, count=3)
    made = made._replace(trials=made.trials + [one._replace(varied=noisy) for one in made.trials])
    results = check_claims(made)
    assert [one.varied for one in results] == [()] * len(CLAIMS) + [noisy] * len(CLAIMS)
    assert all(one.tests for one in results)


def test_claims_hold_by_chance_in_few_of_many():
    """Nothing depends on the PPR: a claim that it does must nearly never fail or hold."""
    decided = sum(
        conclusion_of(campaign(FLAT, seed=seed, tests=('SMT',)), 'In turns in place') != 'not decidable with 30 trials'
        for seed in range(40)
    )
    assert decided <= 4
