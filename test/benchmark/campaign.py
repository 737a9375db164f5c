#!/usr/bin/env python3
"""A campaign on the cores of this machine: time, scaling with workers, memory of a worker over time.

The paper's 360 trials with --trials 30; less for a first look.
"""

from __future__ import annotations

import argparse
import contextlib
import csv
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Dict, List, NamedTuple

import psutil
from checkout import ROOT, print_header
from tabulate import tabulate

SAMPLING_S = 1.0
MEGABYTE = 1e6


class Run(NamedTuple):
    """One campaign."""

    wall_s: float
    simulated_s: float
    outcomes: Dict[str, int]
    early_mb: float  # resident memory of the largest worker, after a tenth of the time
    late_mb: float  # and in the last tenth
    peak_mb: float


def main() -> None:
    """Print the tables."""
    arguments = _arguments()
    print_header(f'campaign {arguments.config}, {arguments.trials} trials a cell, record {arguments.record}')
    rows, runs = [], {}
    for workers in arguments.workers:
        with tempfile.TemporaryDirectory() as folder:
            run = runs[workers] = _run(arguments, workers, Path(folder) / 'out')
        rows.append(
            [
                workers,
                f'{run.wall_s:.1f}',
                f'{run.simulated_s / run.wall_s:.0f}',
                ', '.join(f'{count} {outcome}' for outcome, count in sorted(run.outcomes.items())),
                f'{run.early_mb:.0f}',
                f'{run.late_mb:.0f}',
                f'{run.peak_mb:.0f}',
            ]
        )
        print(f'{workers} workers: {run.wall_s:.1f} s', file=sys.stderr, flush=True)
    print(
        tabulate(
            rows,
            [
                'workers',
                'wall [s],\nwith start',
                'times\nreal time',
                'trials',
                'a worker resident\nearly [MB]',
                '\nlate [MB]',
                '\npeak [MB]',
            ],
            disable_numparse=True,
            stralign='right',
        )
    )
    if 1 in runs and len(runs) > 1:
        most = max(runs)
        print(f'\n{most} workers are {runs[1].wall_s / runs[most].wall_s:.2f} times as fast as 1')


def _run(arguments: argparse.Namespace, workers: int, out: Path) -> Run:
    begin_s = time.monotonic()
    campaign = subprocess.Popen(
        [
            sys.executable,
            str(ROOT / 'scripts' / 'campaign'),
            '--config',
            arguments.config,
            '--out',
            str(out),
            '--trials',
            str(arguments.trials),
            '--workers',
            str(workers),
            '--record',
            arguments.record,
            *(['--tests', *arguments.tests] if arguments.tests else []),
        ],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    samples: List[float] = []
    watcher = threading.Thread(target=_watch, args=(campaign, samples))
    watcher.start()
    status = campaign.wait()
    wall_s = time.monotonic() - begin_s
    watcher.join()
    if status:
        sys.exit(f'the campaign ended with status {status}')
    with open(out / 'trials.csv', newline='', encoding='utf-8') as file:
        trials = list(csv.DictReader(file))
    outcomes = [trial['outcome'] for trial in trials]
    tenth = max(1, len(samples) // 10)
    return Run(
        wall_s,
        sum(float(trial['duration_s']) for trial in trials),
        {outcome: outcomes.count(outcome) for outcome in set(outcomes)},
        samples[tenth],
        max(samples[-tenth:]),
        max(samples),
    )


def _watch(campaign: subprocess.Popen, samples: List[float]) -> None:
    """Resident memory [MB] of the largest process below the client's, again and again."""
    while campaign.poll() is None:
        with contextlib.suppress(psutil.Error):  # one that ended meanwhile
            below = psutil.Process(campaign.pid).children(recursive=True)
            if below:
                samples.append(max(process.memory_info().rss for process in below) / MEGABYTE)
        time.sleep(SAMPLING_S)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--config', default='paper')
    parser.add_argument('--tests', nargs='+', default=None)
    parser.add_argument('--trials', type=int, default=2)
    parser.add_argument('--workers', type=int, nargs='+', default=[1, 2])
    parser.add_argument('--record', default='minimal')
    return parser.parse_args()


if __name__ == '__main__':
    main()
