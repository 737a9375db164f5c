#!/usr/bin/env python3
"""Seconds and memory of `analyze` for a whole campaign: with its bags, and from trials.csv alone."""

from __future__ import annotations

import argparse
import contextlib
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Dict, List

import numpy as np
import psutil
from checkout import ROOT, print_header
from rosbags.highlevel import AnyReader
from tabulate import tabulate

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.sensor_messages import encode_string
from diff_encoder_sim.drives.test_definition import find_world
from diff_encoder_sim.drives.trial_bag import TrialBag
from diff_encoder_sim.drives.trial_definition import TrialPlan
from diff_encoder_sim.trials.campaign_cells import Campaign
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.trials.results import ResultStore
from diff_encoder_sim.trials.trial_run import run_trial
from diff_encoder_sim.trials.trials_csv import TrialRow
from diff_encoder_sim.wheels.encoder_params import ppr_label

ROBOT = ROOT / 'urdf' / 'alto.urdf.xacro'
MEMORY_PERIOD_S = 0.1
# How far the made-up results of a cell are spread: x [m], y [m], yaw [rad].
SPREAD = (0.02, 0.05, 0.02)


def main() -> None:
    """Make the campaign's folder and print the table."""
    arguments = _arguments()
    print_header(f'analyze: the campaign {arguments.config!r}')
    with contextlib.ExitStack() as stack:
        folder = arguments.folder or Path(stack.enter_context(tempfile.TemporaryDirectory()))
        campaign = load_campaign(arguments.config, ROOT)
        if not (folder / 'trials.csv').exists():
            _make(campaign, folder)
        alone = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        for name in ('manifest.json', 'trials.csv'):
            shutil.copy(str(folder / name), str(alone))
        rows = [
            [name, len(campaign.trials()), *_measured(of_folder)]
            for name, of_folder in (('bags', folder), ('trials.csv alone', alone))
        ]
    print(
        tabulate(
            rows,
            ['from', 'trials', 'wall time\n[s]', 'processor\n[s]', 'memory, most\n[MB]'],
            disable_numparse=True,
            colalign=('left', *['right'] * 4),
        )
    )
    print('\nmemory: proportional set size of all processes together, ten times a second.')


def _make(campaign: Campaign, folder: Path) -> None:
    """One trial of each test is run; its bag, as of another trial, is every trial's of that test."""
    rng = np.random.default_rng(1)
    with ResultStore(folder, campaign, {}) as store, tempfile.TemporaryDirectory() as scratch:
        recorded: Dict[str, TrialRow] = {}
        for job in store.pending():
            cell, bag = job.cell, job.bag
            name, trial = cell.test.name, job.definition()
            source = Path(scratch) / f'{name}.bag'
            if name not in recorded:
                world = find_world(cell.test.world, ROOT / 'worlds')
                recorded[name] = run_trial(
                    TrialPlan(trial=trial, world=str(world), map=str(world.with_suffix('.yaml')), bag=str(source)),
                    ROBOT,
                    cell.robot_params,
                    'minimal',
                )
            _copy(source, folder / bag, trial.model_dump_json())
            result = recorded[name]
            errors = {
                key: Pose2D(*(np.array(error) + rng.normal(0.0, SPREAD)).tolist())
                for key, error in result.errors.items()
            }
            store.append(
                TrialRow(
                    name,
                    ppr_label(cell.ppr),
                    cell.varied_texts(),
                    job.trial,
                    job.seed,
                    result.outcome,
                    result.reason,
                    result.duration_s,
                    errors,
                    result.distance_m,
                    1.0,
                    bag,
                )
            )
        store.finish()


def _copy(source: Path, target: Path, about: str) -> None:
    with AnyReader([source]) as reader, TrialBag(target, 'minimal') as bag:
        for connection, time_ns, raw in reader.messages():
            bag.write(
                connection.topic,
                connection.ext.callerid,
                encode_string(about) if connection.topic == topics.TRIAL else raw,
                time_ns,
            )


def _measured(folder: Path) -> List[str]:
    began_s = time.perf_counter()
    process = psutil.Popen(
        [sys.executable, str(ROOT / 'scripts' / 'analyze'), str(folder)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    most_bytes, processor_s = 0, 0.0
    while process.poll() is None:
        with contextlib.suppress(psutil.Error):
            processor_s = sum(process.cpu_times()[:4])  # of its children, too, that have ended
            everyone = [process, *process.children(recursive=True)]
            most_bytes = max(most_bytes, sum(each.memory_full_info().pss for each in everyone))
        time.sleep(MEMORY_PERIOD_S)
    if process.returncode:
        sys.exit(f'analyze {folder} ended with status {process.returncode}')
    return [f'{time.perf_counter() - began_s:.1f}', f'{processor_s:.1f}', f'{most_bytes / 1e6:.0f}']


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog='example: .venv/bin/python test/benchmark/analysis.py --folder /tmp/paper',
    )
    parser.add_argument('--config', default='paper', help='campaign (default: %(default)s)')
    parser.add_argument('--folder', type=Path, metavar='DIR', help='made once and kept, to be measured again')
    return parser.parse_args()


if __name__ == '__main__':
    main()
