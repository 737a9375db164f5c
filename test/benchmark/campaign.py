#!/usr/bin/env python3
"""A campaign on the cores of this machine: time, scaling with workers, memory of a worker. Its processor time is
compared with PyBullet's bare stepping of all trials. --trials 30: the paper's 360 trials."""

from __future__ import annotations

import contextlib
import csv
import resource
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Dict, List, NamedTuple

import psutil
from bench import CONFIG, COUNT, ROOT, Ratio, parser, plan_of, print_header, print_table, report_ratios
from lockstep import BARE, bare_stepping_s

from diff_encoder_sim.trials.robot_params import load_robot_config, override

BARE_S = 50.0  # simulated, before and after each campaign
# 360 trials in 180 s on two cores, if bare stepping has 170 times real time. Fewer trials are mostly the start.
MOST_OF_BARE, PAPERS_TRIALS = 1.65, 30
MOST_MB, MOST_GROWTH = 300.0, 1.1  # memory of a worker
MOST_OF_SEVERAL = 1.0 / 0.95  # 2 workers are to be 1.9 times as fast as 1


class Run(NamedTuple):
    wall_s: float
    processor_s: float  # of the client and its workers
    simulated_s: float
    bare_s: float  # processor time of bare stepping for a simulated second
    memory_mb: List[float]  # of the largest worker, each second


def main() -> None:
    made = parser(__doc__, has_ratios=True, trials=2, repeats=2)
    made.add_argument('--config', default='paper')
    made.add_argument('--workers', type=COUNT, nargs='+', default=[1, 2])
    options = made.parse_args()
    print_header(f'campaign {options.config}, {options.trials} trials of each cell')
    rounds: List[Dict[int, Run]] = []
    for _ in range(options.repeats):
        rounds.append({workers: _run(options.config, options.trials, workers) for workers in options.workers})
    rows = [
        [workers, run.wall_s, run.simulated_s / run.wall_s, 1.0 / run.bare_s, max(run.memory_mb)]
        for runs in rounds
        for workers, run in runs.items()
    ]
    print_table(rows, ['workers', 'wall [s], with start', 'times real time', BARE, 'memory of a worker [MB]'])
    ratios: List[Ratio] = []
    for workers in options.workers:
        runs, name = [each[workers] for each in rounds], f'workers: {workers}'
        bare = [run.processor_s / run.simulated_s / run.bare_s for run in runs]
        tenths = [max(1, len(run.memory_mb) // 10) for run in runs]
        growth = [max(run.memory_mb[-tenth:]) / run.memory_mb[tenth] for run, tenth in zip(runs, tenths)]
        memory = [max(run.memory_mb) / MOST_MB for run in runs]
        limit = MOST_OF_BARE if options.trials >= PAPERS_TRIALS else None
        ratios.append(Ratio(f'processor time, {name}', BARE, bare, limit))
        ratios.append(Ratio(f'memory of a worker, {name}', f'{MOST_MB:g} MB', memory, 1.0))
        ratios.append(Ratio(f'memory of a worker at the end, {name}', 'early', growth, MOST_GROWTH))
        if workers > 1 and 1 in rounds[0]:
            times = [workers * each[workers].wall_s / each[1].wall_s for each in rounds]
            ratios.append(Ratio(f'wall time x workers, {name}', '1 worker', times, MOST_OF_SEVERAL))
    report_ratios(options, ratios)


def _bare_s() -> float:
    return bare_stepping_s(plan_of('DLD', 90, 1), override(load_robot_config(CONFIG), {}), BARE_S) / BARE_S


def _processor_s() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def _run(config: str, trials: int, workers: int) -> Run:
    before_s, spent_s, begin_s = _bare_s(), _processor_s(), time.monotonic()
    with tempfile.TemporaryDirectory() as out:
        words = ['--config', config, '--out', out, '--trials', trials, '--workers', workers, '--record', 'minimal']
        command = [sys.executable, ROOT / 'scripts' / 'campaign', *words]
        campaign = subprocess.Popen([*map(str, command)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        memory_mb: List[float] = []
        watcher = threading.Thread(target=_watch, args=(campaign, memory_mb))
        watcher.start()
        status, wall_s = campaign.wait(), time.monotonic() - begin_s
        watcher.join()
        if status:
            sys.exit(f'the campaign ended with status {status}')
        with open(Path(out) / 'trials.csv', newline='', encoding='utf-8') as file:
            simulated_s = sum(float(trial['duration_s']) for trial in csv.DictReader(file))
    return Run(wall_s, _processor_s() - spent_s, simulated_s, 0.5 * (before_s + _bare_s()), memory_mb)


def _watch(campaign: subprocess.Popen, memory_mb: List[float]) -> None:
    while campaign.poll() is None:
        with contextlib.suppress(psutil.Error):  # ended meanwhile
            below = psutil.Process(campaign.pid).children(recursive=True)
            if below:
                memory_mb.append(max(process.memory_info().rss for process in below) / 1e6)
        time.sleep(1.0)


if __name__ == '__main__':
    main()
