"""Claims about every trial, on whole datasets."""

import pytest
from scipy import stats

from claimed_campaigns import FALLING, campaign, conclusion_of
from diff_encoder_sim.analysis.paper.claims import all_within
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome
from paper_datasets import IN, OUT, cell


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
        made.trials[number] = made.trials[number]._replace(outcome=Outcome.COLLISION)
    return conclusion_of(made, 'completes every route')


def test_one_of_thirty_trials_is_no_evidence_and_eleven_of_one_cell_are():
    assert failing(campaign(FALLING), []) == 'reproduced'
    assert failing(campaign(FALLING), [3]) == 'not contradicted'
    assert failing(campaign(FALLING), range(11)) == 'contradicted'


def test_two_trials_in_every_cell_are_evidence_together():
    assert failing(campaign(FALLING), [30 * cell + number for cell in range(12) for number in (0, 1)]) == 'contradicted'


def test_the_test_is_fishers_with_the_papers_own_trials():
    trials = {('SL', '40'): cell('SL', '40', 'global', [IN] * 25 + [OUT] * 5)}
    [test] = all_within(trials, PoseSource.GLOBAL, ['SL'], ['40'])
    assert test.p_against == pytest.approx(stats.fisher_exact([[25, 5], [30, 0]])[1])
    assert test.text.startswith('SL at 40 PPR: 25 of 30 within, the paper 30 of 30, p 0.05')


def test_a_cell_without_trials_is_not_tested():
    [missing, *_] = all_within({}, PoseSource.GLOBAL, ['SL'], ['40'])
    assert missing.p_against is None
