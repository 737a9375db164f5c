"""campaign: many simulated trials into one results folder. Its help is in campaign_arguments."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import List, NamedTuple, Optional, Sequence

from diff_encoder_sim.analysis.quantities import YAW, X
from diff_encoder_sim.base.command_line import as_called
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.cli.amcl_argument import chosen_files
from diff_encoder_sim.cli.campaign_arguments import parse
from diff_encoder_sim.cli.encoder_notes import name_campaigns_encoders
from diff_encoder_sim.cli.robot_checks import with_checks
from diff_encoder_sim.cli.stopping_spread import name_stopping
from diff_encoder_sim.cli.trial_workers import run_trials_tool, stop_reports, unrun_text, workers
from diff_encoder_sim.robots.xacro_expansion import xacro_arguments
from diff_encoder_sim.trials.campaign_cells import Campaign, TrialJob
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.trials.engine import UnrunTrial, run_campaign
from diff_encoder_sim.trials.progress import Progress, outcome_table, progress_on
from diff_encoder_sim.trials.results import ResultStore, describe_run
from diff_encoder_sim.trials.time_left import time_left
from diff_encoder_sim.trials.trial_run import run_trials
from diff_encoder_sim.trials.worker import RunTrials


def main(arguments: Optional[Sequence[str]] = None, run: RunTrials = run_trials) -> None:
    """Run the command line; `run` runs trials on a worker."""
    options = parse(arguments)
    run_trials_tool('campaign', lambda: _campaign(options, run))


class CampaignRun(NamedTuple):
    """What became of a campaign."""

    table: Path
    summary: str
    unrun: str  # which trials could not be run, and why; '' for none


def _campaign(options: argparse.Namespace, run: RunTrials) -> None:
    done = complete(options, sys.argv, run)
    print(done.table)
    print(done.summary)
    if done.unrun:
        sys.exit(done.unrun)


def complete(options: argparse.Namespace, command: Sequence[str], run: RunTrials = run_trials) -> CampaignRun:
    """Run the trials of a campaign that are missing in its results folder.

    Args:
        options: of the command line.
        command: what the manifest names as the command that repeats this.
        run: runs trials on a worker.

    Raises:
        ConfigError: a file, an option or the results folder is bad.
        CampaignFault: trials cannot go on.
    """
    keys = ('tests', 'ppr', 'encoders', 'trials', 'nav', 'robot', 'record', 'bag_format')
    given = {key: getattr(options, key) for key in keys}
    given['files'] = chosen_files(options)
    arguments = xacro_arguments(options.robot_args)
    campaign = load_campaign(options.config, package_folder(), given, arguments, options.packages)
    campaign = with_checks('campaign', campaign, options.unchecked)
    about = describe_run(package_folder(), command)
    with ResultStore(options.out, campaign, about, options.resume) as store:
        jobs = store.pending()
        if jobs:
            name_campaigns_encoders(as_called('campaign'), campaign)
            name_stopping('campaign', campaign, X.tolerance, YAW.tolerance)
        left = time_left(campaign, jobs, store.rows)
        progress = progress_on(sys.stderr, len(campaign.jobs()), store.rows, left)
        with progress, stop_reports(progress):
            unrun = _run_jobs(options, campaign, store, progress, jobs, run) if jobs else []
            table = store.finish()
        unrun_trials = unrun_text('campaign', campaign, unrun) if unrun else ''
        return CampaignRun(table, _summary(store, progress), unrun_trials)


def _run_jobs(
    options: argparse.Namespace,
    campaign: Campaign,
    store: ResultStore,
    progress: Progress,
    jobs: Sequence[TrialJob],
    run: RunTrials,
) -> List[UnrunTrial]:
    with workers(options, len(jobs)) as ready:
        return run_campaign(ready, campaign, store, progress, jobs, run)


def _summary(store: ResultStore, progress: Progress) -> str:
    duration = f'{progress.wall_time_s():.1f} s, {progress.real_time_factor():.1f} times real time'
    if not progress.done_now:
        duration = 'all trials had been run before: nothing to do'
    return f'{outcome_table(store.rows)}\n{duration}'
