#!/usr/bin/env python3
"""What a campaign costs besides its trials: the start, each trial's path through a process pool and into
trials.csv, and the memory of the workers. The trials do nothing but write a bag of a few kB. What the client spends is
compared with the cost of an empty Dask task (3 ms of the client), as a campaign of Dask tasks would have."""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Dict, List, NamedTuple

import psutil
from checkout import ROOT, print_header
from counts import COUNT, MOST
from ratios import Ratio, add_json, print_ratios, write_ratios
from tabulate import tabulate

from diff_encoder_sim.base.bounds import Between
from diff_encoder_sim.base.command_line import whole_number_within

TRIALS = ROOT / 'test' / 'campaign_trials.py'
FEW_TRIALS = 100  # what more trials cost than these is said: not the start
DASK_TASK_S = 0.003  # the client's processor time of a Dask task that does nothing, measured in 2026
SAMPLE_EVERY_S = 0.05
# How many times what it is compared with.
MOST_OF_CLIENT, MOST_OF_MEMORY = 1.0, 1.25


class Measured(NamedTuple):
    """One campaign."""

    wall_time_s: float
    client_cpu_s: float
    worker_memory_bytes: List[List[int]]  # of each worker, as time went by


class Round(NamedTuple):
    """A campaign of few trials and one of many."""

    start_s: float  # wall time of the few
    trial_s: float  # of each further one, wall time
    client_s: float  # and the client's processor time
    memory_bytes: float  # of the largest worker in the second half of the time
    memory_growth: float  # at the end, in units of what it was in the middle


def main() -> None:
    """Print the tables."""
    arguments = _arguments()
    print_header(f'Overhead of a campaign: {arguments.trials} trials that do nothing')
    rounds = {
        workers: [_round(workers, arguments.trials) for _ in range(arguments.repeats)] for workers in arguments.workers
    }
    _print_costs(rounds)
    ratios = [
        ratio
        for workers, measured in rounds.items()
        for ratio in (
            Ratio(
                f'client, processor time per trial, workers: {workers}',
                'a Dask task',
                [each.client_s / DASK_TASK_S for each in measured],
                MOST_OF_CLIENT,
            ),
            Ratio(
                f'memory of a worker at the end, workers: {workers}',
                'half-way',
                [each.memory_growth for each in measured],
                MOST_OF_MEMORY,
            ),
        )
    ]
    print_ratios(ratios)
    write_ratios(arguments.json, ratios)


def _print_costs(rounds: Dict[int, List[Round]]) -> None:
    rows = [
        [
            workers,
            f'{each.start_s:.1f}',
            f'{1e3 * each.trial_s:.1f}',
            f'{1e3 * each.client_s:.2f}',
            f'{each.memory_bytes / 1e6:.0f}',
        ]
        for workers, measured in rounds.items()
        for each in measured
    ]
    heads = [
        'workers',
        f'{FEW_TRIALS} trials,\nwall [s]',
        'each further,\nwall [ms]',
        "client's processor\ntime of it [ms]",
        'a worker\n[MB]',
    ]
    print(f'{tabulate(rows, heads, disable_numparse=True, stralign="right")}\n')


def _round(workers: int, trials: int) -> Round:
    few, many = _campaign(workers, FEW_TRIALS), _campaign(workers, trials)
    further = trials - FEW_TRIALS
    return Round(
        few.wall_time_s,
        (many.wall_time_s - few.wall_time_s) / further,
        (many.client_cpu_s - few.client_cpu_s) / further,
        max(max(samples[len(samples) // 2 :]) for samples in many.worker_memory_bytes),
        max(_growth(samples) for samples in many.worker_memory_bytes),
    )


def _growth(samples: List[int]) -> float:
    """Return the memory in the last tenth of the time by that in the middle tenth."""
    tenth, middle = max(1, len(samples) // 10), len(samples) // 2
    return max(samples[-tenth:]) / max(samples[middle : middle + tenth])


def _campaign(workers: int, trials: int) -> Measured:
    with tempfile.TemporaryDirectory() as folder:
        environment = {
            **os.environ,
            'CAMPAIGN_TRIALS_FOLDER': folder,
            'PYTHONPATH': os.pathsep.join(filter(None, [str(TRIALS.parent), *sys.path])),
        }
        began_s = time.perf_counter()
        with open(Path(folder) / 'said', 'wb') as said:
            process = psutil.Popen(
                [
                    sys.executable,
                    str(TRIALS),
                    '--config',
                    'paper',
                    '--tests',
                    'SL',
                    '--ppr',
                    '90',
                    '--trials',
                    str(trials),
                    '--workers',
                    str(workers),
                    '--out',
                    f'{folder}/out',
                ],
                env=environment,
                stdout=said,
                stderr=said,
            )
            sampled = _Samples(process)
            sampled.start()
            if process.wait() != 0:
                sys.exit((Path(folder) / 'said').read_text(encoding='utf-8'))
        wall_time_s = time.perf_counter() - began_s
        sampled.join()
    workers_bytes = [samples for _, samples in sorted(sampled.memory_bytes.items()) if len(samples) > 4]
    return Measured(wall_time_s, sampled.client_cpu_s, workers_bytes)


class _Samples(threading.Thread):
    """Reads what a campaign uses until it ends."""

    def __init__(self, client: psutil.Process) -> None:
        super().__init__(daemon=True)
        self._client = client
        self.client_cpu_s = 0.0
        self.memory_bytes: Dict[int, List[int]] = {}

    def run(self) -> None:
        """Sample; the thread ends with the campaign."""
        try:
            while True:
                times = self._client.cpu_times()
                self.client_cpu_s = times.user + times.system
                for child in self._client.children():
                    self.memory_bytes.setdefault(child.pid, []).append(child.memory_info().rss)
                time.sleep(SAMPLE_EVERY_S)
        except psutil.NoSuchProcess:
            pass


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog='example: .venv/bin/python test/benchmark/campaign_overhead.py --trials 10000',
    )
    parser.add_argument('--trials', type=whole_number_within(Between(FEW_TRIALS + 1, MOST)), default=2000)
    parser.add_argument('--workers', type=COUNT, nargs='+', default=[1, 2])
    parser.add_argument('--repeats', type=COUNT, default=2)
    add_json(parser)
    return parser.parse_args()


if __name__ == '__main__':
    main()
