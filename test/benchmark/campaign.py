#!/usr/bin/env python3
"""A campaign on the cores of this machine: time, scaling with workers, memory of a worker over time. Its processor time
is compared with PyBullet's bare stepping of all trials, measured around it.

The paper's 360 trials with --trials 30; less for a first look.
"""

from __future__ import annotations

import argparse
import contextlib
import csv
import resource
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional

import psutil
from bare_stepping import BARE, bare_stepping_s
from checkout import ROOT, print_header
from counts import COUNT
from plans import plan_of
from ratios import Ratio, add_json, print_ratios, write_ratios
from tabulate import tabulate

from diff_encoder_sim.trials.robot_params import load_robot_params

SAMPLING_S = 1.0
MEGABYTE = 1e6
BARE_S = 50.0  # simulated, before and after each campaign
# The paper's 360 trials in 180 s on two cores, where bare stepping has 170 times real time. Of fewer trials the start
# is the larger part.
MOST_OF_BARE, PAPERS_TRIALS = 1.65, 30
# A worker's memory does not depend on the machine [MB].
MOST_MB, MOST_GROWTH = 300.0, 1.1
MOST_OF_SEVERAL = 1.0 / 0.95  # 2 workers are to be 1.9 times as fast as 1


class Run(NamedTuple):
    """One campaign."""

    wall_s: float
    processor_s: float  # of the client and its workers
    simulated_s: float
    bare_s: float  # processor time of bare stepping, for a simulated second
    outcomes: Dict[str, int]
    early_mb: float  # resident memory of the largest worker, after a tenth of the time
    late_mb: float  # and in the last tenth
    peak_mb: float


def main() -> None:
    """Print the tables."""
    arguments = _arguments()
    print_header(f'campaign {arguments.config}, {arguments.trials} trials a cell, record {arguments.record}')
    rounds: List[Dict[int, Run]] = []
    for _ in range(arguments.repeats):
        rounds.append({})
        for workers in arguments.workers:
            with tempfile.TemporaryDirectory() as folder:
                run = rounds[-1][workers] = _run(arguments, workers, Path(folder) / 'out')
            print(f'{workers} workers: {run.wall_s:.1f} s', file=sys.stderr, flush=True)
    _print_table(rounds)
    most_of_bare = MOST_OF_BARE if arguments.trials >= PAPERS_TRIALS else None
    ratios = [ratio for workers in arguments.workers for ratio in _ratios(workers, rounds, most_of_bare)]
    print_ratios(ratios)
    write_ratios(arguments.json, ratios)


def _print_table(rounds: List[Dict[int, Run]]) -> None:
    rows = [
        [
            workers,
            f'{run.wall_s:.1f}',
            f'{run.simulated_s / run.wall_s:.0f}',
            f'{1.0 / run.bare_s:.0f}',
            ', '.join(f'{count} {outcome}' for outcome, count in sorted(run.outcomes.items())),
            f'{run.early_mb:.0f}',
            f'{run.late_mb:.0f}',
            f'{run.peak_mb:.0f}',
        ]
        for runs in rounds
        for workers, run in runs.items()
    ]
    heads = [
        'workers',
        'wall [s],\nwith start',
        'times\nreal time',
        'bare\nstepping',
        'trials',
        'a worker resident\nearly [MB]',
        '\nlate [MB]',
        '\npeak [MB]',
    ]
    print(f'{tabulate(rows, heads, disable_numparse=True, stralign="right")}\n')


def _ratios(workers: int, rounds: List[Dict[int, Run]], most_of_bare: Optional[float]) -> List[Ratio]:
    runs = [each[workers] for each in rounds]
    bare = [run.processor_s / run.simulated_s / run.bare_s for run in runs]
    name = f'workers: {workers}'
    ratios = [
        Ratio(f'processor time, {name}', BARE, bare, most_of_bare),
        Ratio(f'memory of a worker, {name}', f'{MOST_MB:g} MB', [run.peak_mb / MOST_MB for run in runs], 1.0),
        Ratio(f'memory of a worker at the end, {name}', 'early', [r.late_mb / r.early_mb for r in runs], MOST_GROWTH),
    ]
    if workers > 1 and 1 in rounds[0]:
        times = [workers * each[workers].wall_s / each[1].wall_s for each in rounds]
        ratios.append(Ratio(f'wall time x workers, {name}', '1 worker', times, MOST_OF_SEVERAL))
    return ratios


def _bare_s() -> float:
    """Return the processor time of bare stepping for a simulated second."""
    return bare_stepping_s(plan_of('DLD', 90, 1), load_robot_params(ROOT / 'config'), BARE_S) / BARE_S


def _processor_s() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def _run(arguments: argparse.Namespace, workers: int, out: Path) -> Run:
    before_s, spent_s, begin_s = _bare_s(), _processor_s(), time.monotonic()
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
        _processor_s() - spent_s,
        sum(float(trial['duration_s']) for trial in trials),
        statistics.mean([before_s, _bare_s()]),
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
    parser.add_argument('--trials', type=COUNT, default=2)
    parser.add_argument('--workers', type=COUNT, nargs='+', default=[1, 2])
    parser.add_argument('--record', default='minimal')
    parser.add_argument('--repeats', type=COUNT, default=2)
    add_json(parser)
    return parser.parse_args()


if __name__ == '__main__':
    main()
