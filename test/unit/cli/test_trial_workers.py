"""What tools that run trials print of trials that did not run."""

import argparse
import os
import signal
from types import SimpleNamespace

import pytest

from diff_encoder_sim.api.campaigns import stop_reports, unrun_text, workers
from diff_encoder_sim.base.command_line import run_trials_tool
from diff_encoder_sim.base.errors import CampaignFault, ConfigError
from diff_encoder_sim.cli.arguments import add_workers
from diff_encoder_sim.trials.engine import UnrunTrial

CAMPAIGN = SimpleNamespace(bag_name=lambda job: f'bags/SL_90ppr_trial{job}.bag')


def test_trials_that_could_not_be_run_are_named_by_reason():
    unrun = [UnrunTrial(job, 'out of memory', False) for job in range(7)] + [UnrunTrial(9, 'worker lost', True)]
    assert unrun_text('campaign', CAMPAIGN, unrun).splitlines() == [
        'campaign: 7 trials could not be run (out of memory): '
        + ', '.join(f'SL_90ppr_trial{k}' for k in range(5))
        + ', ...',
        'campaign: 1 trial could not be run (worker lost): SL_90ppr_trial9',
        'campaign: run the same command again to retry them',
    ]


def test_a_fault_of_the_campaign_is_one_line():
    def fail():
        raise CampaignFault('the scheduler is gone')

    with pytest.raises(SystemExit) as ended:
        run_trials_tool('campaign', fail)
    assert ended.value.code == 'campaign: the scheduler is gone'


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_tool_with_its_status_and_says_how_many_trials_are_done(number, capsys):
    handlers = [signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)]

    def tool():
        with stop_reports(SimpleNamespace(count=lambda: '12 of 40 trials')):
            os.kill(os.getpid(), number)

    with pytest.raises(SystemExit) as ended:
        run_trials_tool('campaign', tool)
    assert ended.value.code == 128 + number
    assert capsys.readouterr().err == (
        'campaign: stopped after 12 of 40 trials; run the same command again to continue\n'
    )
    assert [signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)] == handlers


@pytest.mark.parametrize(
    'arguments',
    [
        '--tls-ca a --tls-cert b',
        '--tls-ca a --tls-cert b --scheduler tcp://host:8786',
        '--tls-cert b --tls-key c --scheduler tls://host:8786',
        '--tls-ca a --workers 2',
    ],
)
def test_options_for_tls_without_a_cluster_that_uses_them_are_an_error(arguments):
    parser = argparse.ArgumentParser()
    add_workers(parser)
    with pytest.raises(ConfigError, match='^given --tls-.*; allowed: --tls-ca and --tls-cert, with --scheduler tls://'):
        workers(parser.parse_args(arguments.split()), 1)
