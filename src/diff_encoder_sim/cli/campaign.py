"""campaign: runs many trials of tests, encoders and parameters into one folder of results."""
from __future__ import annotations

import argparse
import contextlib
import logging
import math
import signal
import sys
from pathlib import Path
from typing import ContextManager, Dict, Iterator, List, Optional, Sequence

from distributed import Client

from diff_encoder_sim.campaign.cluster import connected_client, local_client, usable_cores
from diff_encoder_sim.campaign.definition import Campaign
from diff_encoder_sim.campaign.engine import CampaignFault, UnrunTrial, run_campaign
from diff_encoder_sim.campaign.loading import load_campaign
from diff_encoder_sim.campaign.manifest import describe_run
from diff_encoder_sim.campaign.progress import Progress, outcome_table, progress_on
from diff_encoder_sim.campaign.store import ResultStore
from diff_encoder_sim.campaign.worker import RunTrial
from diff_encoder_sim.cli.run import package_folder, run_tool
from diff_encoder_sim.experiments.trial_run import run_trial

STOPPING_SIGNALS = (signal.SIGINT, signal.SIGTERM)
UNRUN_SHOWN = 5


class _Stopped(BaseException):
    """By a signal. Not an Exception: nothing on its way up takes it for an error."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number
        self.when = 'before the first trial'


def main(arguments: Optional[Sequence[str]] = None, run: RunTrial = run_trial) -> None:
    """Entry point of the executable; `run` runs one trial on a worker."""
    options = _parse(arguments)
    logging.basicConfig(format='campaign: %(message)s')
    try:
        with _signals_raise():
            run_tool('campaign', lambda: _campaign(options, run))
    except CampaignFault as fault:
        sys.exit(f'campaign: {fault}')
    except _Stopped as stopped:
        print(f'campaign: stopped {stopped.when}', file=sys.stderr)
        sys.exit(128 + stopped.number)


def _campaign(options: argparse.Namespace, run: RunTrial) -> None:
    campaign = load_campaign(options.config, package_folder(), {
        'tests': options.tests, 'ppr': options.ppr, 'trials': options.trials,
        'robot': options.robot, 'record': options.record})
    about = describe_run(package_folder(), sys.argv)
    with ResultStore(options.out, campaign, about, options.resume) as store:
        progress = progress_on(sys.stderr, len(campaign.jobs()), store.rows)
        with progress, _told(progress):
            unrun = _run_pending(options, campaign, store, progress, run)
            table = store.finish()
        print(table)
        print(_summary(store, progress))
    if unrun:
        sys.exit(_unrun_text(campaign, unrun))


def _run_pending(options: argparse.Namespace, campaign: Campaign, store: ResultStore,
                 progress: Progress, run: RunTrial) -> List[UnrunTrial]:
    pending = len(store.pending())
    if pending == 0:
        return []
    with _client(options, pending) as client:
        return run_campaign(client, campaign, store, progress, run)


def _client(options: argparse.Namespace, pending: int) -> ContextManager[Client]:
    if options.scheduler is not None:
        return connected_client(options.scheduler)
    return local_client(min(options.workers or usable_cores(), pending))


def _summary(store: ResultStore, progress: Progress) -> str:
    now = (f'{progress.wall_time_s():.1f} s, {progress.real_time_factor():.1f} times real time'
           if progress.done_now else 'every trial was done before')
    return f'{outcome_table(store.rows)}\n{now}'


def _unrun_text(campaign: Campaign, unrun: Sequence[UnrunTrial]) -> str:
    by_reason: Dict[str, List[str]] = {}
    for trial in unrun:
        name = Path(campaign.bag_name(trial.job)).stem
        by_reason.setdefault(trial.reason, []).append(name)
    lines = []
    for reason, names in by_reason.items():
        more = ', ...' if len(names) > UNRUN_SHOWN else ''
        lines.append(f'campaign: {len(names)} trials could not be run ({reason}): '
                     f'{", ".join(names[:UNRUN_SHOWN])}{more}')
    return '\n'.join(lines + ['campaign: the same command tries them again'])


@contextlib.contextmanager
def _signals_raise() -> Iterator[None]:
    def stop(number: int, _: object) -> None:
        for each in STOPPING_SIGNALS:
            signal.signal(each, signal.SIG_DFL)     # a second one ends the process at once
        raise _Stopped(number)

    before = {number: signal.signal(number, stop) for number in STOPPING_SIGNALS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextlib.contextmanager
def _told(progress: Progress) -> Iterator[None]:
    """Let who is told that the campaign was stopped know how far it is."""
    try:
        yield
    except _Stopped as stopped:
        stopped.when = f'after {progress.count()}; the same command goes on'
        raise


def _parse(arguments: Optional[Sequence[str]]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog='campaign', description=__doc__,
        epilog='example: campaign --config paper --out results/paper --tests SL --ppr 40 90. The '
               'same command again goes on with what is not done yet.')
    parser.add_argument('--config', required=True, metavar='NAME|FILE',
                        help='a file of config/campaigns/, or a .yaml file')
    parser.add_argument('--out', required=True, type=Path, metavar='DIR',
                        help='new, or with results of the same configuration')
    parser.add_argument('--tests', nargs='+', metavar='TEST', help='names, or .yaml files')
    parser.add_argument('--ppr', nargs='+', type=_ppr, metavar='N', help='pulses per revolution')
    parser.add_argument('--trials', type=_count, metavar='N', help='of each test with each encoder')
    parser.add_argument('--robot', metavar='FILE',
                        help='a .yaml file like config/alto.yaml, or a xacro or URDF file')
    parser.add_argument('--record', choices=('full', 'minimal', 'none'),
                        help='topics in the bags; minimal leaves out scans and other bulk')
    where = parser.add_mutually_exclusive_group()
    where.add_argument('--workers', type=_count, metavar='N',
                       help='processes on this machine (default: one for each core)')
    where.add_argument('--scheduler', metavar='ADDRESS',
                       help='of a running Dask cluster, such as tcp://host:8786 (docs/cluster.md)')
    parser.add_argument('--resume', action='store_true',
                        help='fail unless DIR has results to go on with')
    return parser.parse_args(arguments)


def _ppr(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0):
        raise argparse.ArgumentTypeError(f'given {text!r}; allowed: a number greater than 0')
    return value


def _count(text: str) -> int:
    if not (text.isascii() and text.isdigit() and int(text) > 0):
        raise argparse.ArgumentTypeError(f'given {text!r}; allowed: a whole number from 1')
    return int(text)
