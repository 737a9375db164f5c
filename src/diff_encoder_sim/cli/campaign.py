"""campaign: runs many trials of tests, encoders and parameters into one folder of results."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import List, Optional, Sequence

from diff_encoder_sim.base.paths import package_folder
from diff_encoder_sim.campaign.campaign_definition import Campaign
from diff_encoder_sim.campaign.campaign_loading import load_campaign
from diff_encoder_sim.campaign.engine import UnrunTrial, run_campaign
from diff_encoder_sim.campaign.manifest import describe_run
from diff_encoder_sim.campaign.progress import Progress, outcome_table, progress_on
from diff_encoder_sim.campaign.store import ResultStore
from diff_encoder_sim.campaign.worker import RunTrial
from diff_encoder_sim.cli.trial_workers import add_workers, count, positive, run_trials_tool, told, unrun_text, workers
from diff_encoder_sim.lockstep.trial_run import run_trial


def main(arguments: Optional[Sequence[str]] = None, run: RunTrial = run_trial) -> None:
    """Entry point of the executable; `run` runs one trial on a worker."""
    options = _parse(arguments)
    run_trials_tool('campaign', lambda: _campaign(options, run))


def _campaign(options: argparse.Namespace, run: RunTrial) -> None:
    campaign = load_campaign(
        options.config,
        package_folder(),
        {
            'tests': options.tests,
            'ppr': options.ppr,
            'trials': options.trials,
            'robot': options.robot,
            'record': options.record,
        },
    )
    about = describe_run(package_folder(), sys.argv)
    with ResultStore(options.out, campaign, about, options.resume) as store:
        progress = progress_on(sys.stderr, len(campaign.jobs()), store.rows)
        with progress, told(progress):
            unrun = _run_pending(options, campaign, store, progress, run)
            table = store.finish()
        print(table)
        print(_summary(store, progress))
    if unrun:
        sys.exit(unrun_text('campaign', campaign, unrun))


def _run_pending(
    options: argparse.Namespace, campaign: Campaign, store: ResultStore, progress: Progress, run: RunTrial
) -> List[UnrunTrial]:
    pending = store.pending()
    if not pending:
        return []
    with workers(options, len(pending)) as client:
        return run_campaign(client, campaign, store, progress, pending, run)


def _summary(store: ResultStore, progress: Progress) -> str:
    now = (
        f'{progress.wall_time_s():.1f} s, {progress.real_time_factor():.1f} times real time'
        if progress.done_now
        else 'every trial was done before'
    )
    return f'{outcome_table(store.rows)}\n{now}'


def _parse(arguments: Optional[Sequence[str]]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog='campaign',
        description=__doc__,
        epilog='example: campaign --config paper --out results/paper --tests SL --ppr 40 90. The '
        'same command again goes on with what is not done yet.',
    )
    parser.add_argument(
        '--config', required=True, metavar='NAME|FILE', help='a file of config/campaigns/, or a .yaml file'
    )
    parser.add_argument(
        '--out', required=True, type=Path, metavar='DIR', help='new, or with results of the same configuration'
    )
    parser.add_argument('--tests', nargs='+', metavar='TEST', help='names, or .yaml files')
    parser.add_argument('--ppr', nargs='+', type=positive, metavar='N', help='pulses per revolution')
    parser.add_argument('--trials', type=count, metavar='N', help='of each test with each encoder')
    parser.add_argument('--robot', metavar='FILE', help='a .yaml file like config/alto.yaml, or a xacro or URDF file')
    parser.add_argument(
        '--record',
        choices=('full', 'minimal', 'none'),
        help='topics in the bags; minimal leaves out scans and other bulk',
    )
    add_workers(parser)
    parser.add_argument('--resume', action='store_true', help='fail unless DIR has results to go on with')
    return parser.parse_args(arguments)
