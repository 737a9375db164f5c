"""What tools that run trials accept as numbers, and what they print of trials that did not run."""

import argparse
import os
import signal
from types import SimpleNamespace

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.campaign.engine import CampaignFault, UnrunTrial
from diff_encoder_sim.cli.trial_workers import (
    add_workers,
    positive_number,
    run_trials_tool,
    stop_reports,
    unrun_text,
    whole_number,
    workers,
)

CAMPAIGN = SimpleNamespace(bag_name=lambda job: f'bags/SL_90ppr_trial{job}.bag')


@pytest.mark.parametrize('text', ['0', '-1', 'nan', 'inf', 'ninety', ''])
def test_numbers_are_finite_and_greater_than_0(text):
    with pytest.raises(argparse.ArgumentTypeError, match='allowed: a number greater than 0'):
        positive_number(text)
    assert positive_number('1632.67') == 1632.67


@pytest.mark.parametrize('text', ['0', '-1', '1.5', '1e3', '\u0663', ''])
def test_counts_are_whole_numbers_from_1(text):
    with pytest.raises(argparse.ArgumentTypeError, match='allowed: a whole number from 1'):
        whole_number(text)
    assert whole_number('30') == 30


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
