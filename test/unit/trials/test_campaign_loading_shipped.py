"""The package's own campaigns, a short trial of each: its parameters drive a robot to the goal of SMT."""

import pytest

from campaign_files import ROOT
from diff_encoder_sim.drives.trial_definition import Outcome, TrialPlan
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.trials.trial_run import run_trial

NAMES = sorted(path.stem for path in (ROOT / 'config' / 'campaigns').glob('*.yaml'))


@pytest.mark.heavy
@pytest.mark.parametrize('name', NAMES)
def test_a_trial_comes_to_its_goal(name, tmp_path):
    campaign = load_campaign(name, ROOT, {'tests': ['SMT'], 'ppr': [90.0], 'trials': 1})
    job, *_ = campaign.trials()
    files = campaign.files.materialise(tmp_path)
    plan = TrialPlan(trial=job.definition(), bag='', **files.worlds['SMT']._asdict())
    result = run_trial(plan, files.robot, campaign.cells[0].robot_params, 'none')
    assert (result.outcome, result.reason) == (Outcome.SUCCEEDED, '')
    assert 30.0 < result.duration_s < 90.0
