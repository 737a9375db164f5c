#!/usr/bin/env python3
"""What a campaign costs beside its trials: the start, each trial's way through Dask and into
trials.csv, and the memory of the workers. The trials do nothing but write a bag of a few kB."""

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
from tabulate import tabulate

TRIALS = ROOT / 'test' / 'campaign_trials.py'
LARGE_CAMPAIGN = 10_000
SAMPLE_EVERY_S = 0.2


class Measured(NamedTuple):
    """One campaign."""

    wall_time_s: float
    client_cpu_s: float
    worker_memory_bytes: Dict[int, List[int]]  # resident, by process id, as time went by


def main() -> None:
    """Print the table."""
    arguments = _arguments()
    print_header(f'Overhead of a campaign: {arguments.trials} trials that do nothing')
    rows = []
    for workers in arguments.workers:
        short = _campaign(workers, workers)
        long = _campaign(workers, arguments.trials)
        per_trial_s = (long.wall_time_s - short.wall_time_s) / (arguments.trials - workers)
        memory = [samples for samples in long.worker_memory_bytes.values() if len(samples) > 4]
        rows.append(
            [
                workers,
                f'{short.wall_time_s:.1f}',
                f'{1e3 * per_trial_s:.1f}',
                f'{1e3 * long.client_cpu_s / arguments.trials:.1f}',
                f'{short.wall_time_s + LARGE_CAMPAIGN * per_trial_s:.0f}',
                f'{max(map(max, memory)) / 1e6:.0f}',
                f'{max(samples[-1] - samples[len(samples) // 2] for samples in memory) / 1e6:.1f}',
            ]
        )
    print(
        tabulate(
            rows,
            [
                'workers',
                'start and\nend [s]',
                'wall per\ntrial [ms]',
                'client CPU\nper trial [ms]',
                f'{LARGE_CAMPAIGN}\ntrials [s]',
                'worker\n[MB]',
                'growth in\n2nd half [MB]',
            ],
            disable_numparse=True,
            stralign='right',
        )
    )
    print('\nStart and end: a campaign of one trial per worker, from the command to its exit.')


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
    return Measured(wall_time_s, sampled.client_cpu_s, sampled.memory_bytes)


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
        epilog='example: .venv/bin/python test/benchmark/campaign_overhead.py --trials 200',
    )
    parser.add_argument('--trials', type=int, default=1000)
    parser.add_argument('--workers', type=int, nargs='+', default=[1, 2])
    return parser.parse_args()


if __name__ == '__main__':
    main()
