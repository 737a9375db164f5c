"""Statements about all trials of a cell, on whole datasets."""

from claimed_campaigns import FALLING, campaign, conclusion_of
from diff_encoder_sim.trials.trial_outcome import Outcome


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
