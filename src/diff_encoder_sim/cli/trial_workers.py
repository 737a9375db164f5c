"""What tools that run trials share: worker processes, signals that stop them, trials that did not run."""

from __future__ import annotations

import argparse
import contextlib
import logging
import signal
import sys
from pathlib import Path
from typing import Callable, ContextManager, Dict, Iterator, List, Optional, Sequence

from diff_encoder_sim.base.command_line import as_called, run_tool
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.processes import usable_cores
from diff_encoder_sim.trials.campaign_cells import Campaign
from diff_encoder_sim.trials.cluster import TlsFiles, Workers, connected_workers
from diff_encoder_sim.trials.engine import CampaignFault, UnrunTrial
from diff_encoder_sim.trials.local_workers import local_workers
from diff_encoder_sim.trials.progress import Progress

STOPPING_SIGNALS = (signal.SIGINT, signal.SIGTERM)
UNRUN_SHOWN = 5


class _Stopped(BaseException):
    """A signal stopped the tool. Not an Exception: nothing on its way up may take it for an error."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number
        self.when = 'before the first trial'


def run_trials_tool(name: str, tool: Callable[[], None]) -> None:
    """Run a tool that runs trials; a fault or a signal prints one line and sets the exit status."""
    logging.basicConfig(format=f'{as_called(name)}: %(message)s')
    try:
        with _signals_raise():
            run_tool(name, tool)
    except CampaignFault as fault:
        sys.exit(f'{as_called(name)}: {fault}')
    except _Stopped as stopped:
        print(f'{as_called(name)}: stopped {stopped.when}', file=sys.stderr)
        sys.exit(128 + stopped.number)


@contextlib.contextmanager
def stop_reports(progress: Progress) -> Iterator[None]:
    """Let the line that says that the tool was stopped say how many trials are done."""
    try:
        yield
    except _Stopped as stopped:
        stopped.when = f'after {progress.count()}; run the same command again to continue'
        raise


def workers(options: argparse.Namespace, pending: int) -> ContextManager[Workers]:
    """Return the workers that the options select, on this host no more than there are `pending` trials.

    Raises:
        ConfigError: an option for TLS is given where it has no effect, or misses another.
    """
    tls = _tls_files(options)
    if options.scheduler is not None:
        return connected_workers(options.scheduler, tls)
    return local_workers(min(options.workers or usable_cores(), pending))


def _tls_files(options: argparse.Namespace) -> Optional[TlsFiles]:
    given = [f'--tls-{name}' for name in TlsFiles._fields if getattr(options, f'tls_{name}') is not None]
    if not given:
        return None
    if options.tls_ca is None or options.tls_cert is None or not (options.scheduler or '').startswith('tls://'):
        raise ConfigError(
            f'given {", ".join(given)}; allowed: --tls-ca and --tls-cert, with --scheduler tls://HOST:PORT'
        )
    return TlsFiles(options.tls_ca, options.tls_cert, options.tls_key)


def unrun_text(name: str, campaign: Campaign, unrun: Sequence[UnrunTrial]) -> str:
    """Say which trials could not be run and why, for the terminal."""
    by_reason: Dict[str, List[str]] = {}
    for trial in unrun:
        bag = Path(campaign.bag_name(trial.job)).stem
        by_reason.setdefault(trial.reason, []).append(bag)
    lines = []
    for reason, bags in by_reason.items():
        count = '1 trial' if len(bags) == 1 else f'{len(bags)} trials'
        more = ', ...' if len(bags) > UNRUN_SHOWN else ''
        lines.append(f'{as_called(name)}: {count} could not be run ({reason}): {", ".join(bags[:UNRUN_SHOWN])}{more}')
    return '\n'.join([*lines, f'{as_called(name)}: run the same command again to retry them'])


@contextlib.contextmanager
def _signals_raise() -> Iterator[None]:
    def stop(number: int, _: object) -> None:
        for each in STOPPING_SIGNALS:
            signal.signal(each, signal.SIG_DFL)  # a second one ends the process at once
        raise _Stopped(number)

    before = {number: signal.signal(number, stop) for number in STOPPING_SIGNALS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
