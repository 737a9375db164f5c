"""Conclusions about claims, from those of their parts."""

import pytest

from claimed_campaigns import FALLING, campaign, conclusion_of
from diff_encoder_sim.analysis.paper.claims import (
    CLAIMS,
    ClaimResult,
    Conclusion,
    HypothesisTest,
    check_claims,
    claim_conclusion,
)

HOLDS, FAILS, UNCLEAR = Conclusion.HOLDS, Conclusion.FAILS, Conclusion.UNCLEAR


@pytest.mark.parametrize(
    ('parts', 'expected'),
    [
        ([HOLDS, HOLDS], 'reproduced'),
        ([HOLDS, FAILS, UNCLEAR], 'contradicted'),
        ([HOLDS, UNCLEAR], 'not contradicted'),
        ([], 'not tested: too few trials'),
    ],
)
def test_the_conclusion_of_parts(parts, expected):
    assert claim_conclusion([HypothesisTest(part, '', 0.5) for part in parts]) == expected


def test_what_is_missing_is_not_tested():
    few = campaign(FALLING, tests=('SL',), pprs=('40', '90'), count=5)
    assert conclusion_of(few, 'steadier odometry') == 'not tested: too few trials'
    assert conclusion_of(few, 'Odometry is poor') == 'not tested: too few trials'
    (result,) = [one for one in check_claims(few) if 'Odometry is poor' in one.text]
    assert 'too few trials' in result.tests[0].text and result.p_text == ''


def test_the_p_value_is_that_of_the_part_most_against_the_claim():
    tests = [HypothesisTest(UNCLEAR, '', 0.6), HypothesisTest(FAILS, '', 0.031), HypothesisTest(UNCLEAR, '')]
    result = ClaimResult('', '', (), '', tests)
    assert result.p_text == 'p 0.031'
    assert result._replace(tests=[HypothesisTest(FAILS, '', 1e-9)]).p_text == 'p < 0.0001'


def test_every_claim_is_tested_for_each_set_of_parameters():
    noisy = (('simulator.lidar.noise', '0.1'),)
    made = campaign(FALLING, count=3)
    made = made._replace(trials=made.trials + [one._replace(varied=noisy) for one in made.trials])
    results = check_claims(made)
    assert [one.varied for one in results] == [()] * len(CLAIMS) + [noisy] * len(CLAIMS)
    assert all(one.tests for one in results)
