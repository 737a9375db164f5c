"""Conclusions about claims, from those of their parts."""

import pytest

from claimed_campaigns import FALLING, campaign, conclusion_of
from diff_encoder_sim.analysis.paper.claim_results import check_claims, claim_conclusion
from diff_encoder_sim.analysis.paper.claims import CLAIMS
from diff_encoder_sim.analysis.paper.hypothesis_tests import Conclusion, HypothesisTest

HOLDS, FAILS, UNCLEAR = Conclusion.HOLDS, Conclusion.FAILS, Conclusion.UNCLEAR


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
