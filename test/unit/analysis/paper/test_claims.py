"""The paper's claims on datasets made to reproduce, refute or leave each of them open."""

import pytest

from claimed_campaigns import FALLING, FLAT, RISING, campaign, conclusion_of
from diff_encoder_sim.analysis.paper.paper_cells import PPRS
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.topics import PoseSource


@pytest.mark.parametrize(
    ('spreads_of_odom', 'expected'), [(FALLING, 'reproduced'), (FLAT, 'not contradicted'), (RISING, 'contradicted')]
)
def test_steadier_odometry_with_a_higher_resolution(spreads_of_odom, expected):
    assert conclusion_of(campaign(spreads_of_odom), 'steadier odometry') == expected


@pytest.mark.parametrize(
    ('spreads_of_odom', 'expected'),
    [
        (dict.fromkeys(PPRS, 0.2), 'reproduced'),
        (FLAT, 'reproduced'),
        (dict.fromkeys(PPRS, 0.05), 'not contradicted'),
        (FALLING, 'contradicted'),
    ],
)
def test_poor_odometry_in_the_long_drive(spreads_of_odom, expected):
    assert conclusion_of(campaign(spreads_of_odom), 'Odometry is poor') == expected


def test_amcl_within_tolerance_is_contradicted_by_many_trials_not_by_one():
    made = campaign(FALLING)
    assert conclusion_of(made, 'By AMCL') == 'reproduced'
    made.trials[7].errors[PoseSource.GLOBAL] = Pose2D(0.06, 0.0, 0.0)
    assert conclusion_of(made, 'By AMCL') == 'not contradicted'
    for trial in made.trials[:12]:
        trial.errors[PoseSource.GLOBAL] = Pose2D(0.06, 0.0, 0.0)
    assert conclusion_of(made, 'By AMCL') == 'contradicted'


def test_heading_within_three_degrees_by_resolution():
    turned = {'odom': (0.0, 0.0, 5.0), 'world': (0.0, 0.0, 5.0), 'global': (0.0, 0.0, 5.0)}
    coarse = campaign(FALLING, pprs=PPRS[:2], **turned)
    fine = campaign(FALLING, pprs=PPRS[2:])
    as_claimed = fine._replace(trials=coarse.trials + fine.trials)
    assert conclusion_of(as_claimed, 'The heading is within 3') == 'reproduced'
    assert conclusion_of(campaign(FALLING), 'The heading is within 3') == 'contradicted'


def test_claims_hold_by_chance_in_few_of_many():
    """Nothing depends on the PPR: a claim that it does must nearly never fail or hold."""
    decided = sum(
        conclusion_of(campaign(FLAT, seed=seed, tests=('SMT',)), 'In turns in place') != 'not contradicted'
        for seed in range(40)
    )
    assert decided <= 4
