#!/usr/bin/env python3
"""The same trials on the live graph and in lockstep: whether analysis can tell the two apart.

Scripted drives: encoder counts at equal stamps, which may differ by one pulse. Navigated ones: the
distributions of the final errors of each source of poses, by the two-sample Kolmogorov-Smirnov
test, and their means; with enough trials a difference that matters would show. Needs the sourced
workspace.
"""

from __future__ import annotations

import argparse
import math
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Dict, List, Tuple

import numpy as np
from checkout import ROOT, print_header
from counts import COUNT
from live_graph import check_sourced, start_master, stop
from plans import plan_of
from rosbags.highlevel import AnyReader
from scipy.stats import ks_2samp
from tabulate import tabulate

from diff_encoder_sim.analysis.results_loading import goal_errors
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.topics import TOPIC_OF_SOURCE, PoseSource
from diff_encoder_sim.drives.trial_recording import read_trial
from diff_encoder_sim.trials.robot_params import load_robot_params
from diff_encoder_sim.trials.trial_run import run_trial

CONFIG, ROBOT = ROOT / 'config', ROOT / 'urdf' / 'alto.urdf.xacro'
AXES = ('x [mm]', 'y [mm]', 'yaw [deg]')
UNITS = np.array([1e3, 1e3, math.degrees(1.0)])
# Over all comparisons of a run: one false alarm in twenty runs.
SIGNIFICANCE = 0.05


def main() -> None:
    """Run everything and print the tables; ends with status 1 if the two differ."""
    arguments = _arguments()
    check_sourced()
    print_header(f'{arguments.trials} trials live (rtf:={arguments.rtf:g}) and in lockstep')
    with tempfile.TemporaryDirectory() as folder:
        master = start_master(Path(folder))
        try:
            differs = _compare_scripted(arguments, Path(folder))
            differs |= _compare_navigated(arguments, Path(folder))
        finally:
            stop(master)
    sys.exit(differs)


def _compare_scripted(arguments: argparse.Namespace, folder: Path) -> bool:
    rows = []
    for test in arguments.scripted:
        for ppr in arguments.ppr:
            live, lockstep = (_counts(bag) for bag in _both(test, ppr, 1, 'scripted', arguments, folder))
            common = sorted(live.keys() & lockstep.keys())
            off = np.abs([np.subtract(live[stamp_ns], lockstep[stamp_ns]) for stamp_ns in common])
            rows.append([test, ppr, len(live), len(lockstep), len(common), np.max(off, initial=0)])
    print(
        tabulate(
            rows,
            ['scripted', 'PPR', 'samples\nlive', 'lockstep', 'of one stamp', 'largest difference\n[pulses]'],
            stralign='right',
        ),
        '\n',
        flush=True,
    )
    return any(row[-1] > 1 or row[4] < max(1, 0.99 * row[2]) for row in rows)


def _compare_navigated(arguments: argparse.Namespace, folder: Path) -> bool:
    rows, p_values = [], []
    for test in arguments.tests:
        for ppr in arguments.ppr:
            errors = np.array(
                [
                    [_errors(bag) for bag in _both(test, ppr, trial, 'embedded', arguments, folder)]
                    for trial in range(1, arguments.trials + 1)
                ]
            )  # trial, way, source, axis
            for i, source in enumerate(PoseSource):
                for j, axis in enumerate(AXES):
                    live, lockstep = errors[:, 0, i, j], errors[:, 1, i, j]
                    p_values.append(ks_2samp(live, lockstep).pvalue)
                    rows.append(
                        [
                            test,
                            ppr,
                            TOPIC_OF_SOURCE[source],
                            axis,
                            *(f'{values.mean():+.1f} +- {values.std(ddof=1):.1f}' for values in (live, lockstep)),
                            f'{p_values[-1]:.2f}',
                        ]
                    )
            print(f'{test} {ppr} PPR done', file=sys.stderr, flush=True)
    print(
        tabulate(
            rows,
            ['test', 'PPR', 'source', 'axis', 'live: mean +- sigma', 'lockstep', 'p'],
            disable_numparse=True,
            stralign='right',
        )
    )
    least = min(p_values, default=1.0)
    limit = SIGNIFICANCE / max(1, len(p_values))
    print(f'\nleast p {least:.4f}; the two differ below {limit:.5f} (Bonferroni over {len(p_values)} comparisons)')
    return bool(least < limit)


def _both(test: str, ppr: int, trial: int, nav: str, arguments: argparse.Namespace, folder: Path) -> Tuple[Path, Path]:
    live, lockstep = (folder / f'{way}.bag' for way in ('live', 'lockstep'))
    for bag in (live, lockstep):
        bag.unlink(missing_ok=True)
    subprocess.run(
        [
            'roslaunch',
            'diff_encoder_sim',
            'trial.launch',
            f'nav:={nav}',
            f'test:={test}',
            f'ppr:={ppr}',
            f'trial:={trial}',
            f'rtf:={arguments.rtf}',
            f'bag:={live}',
        ],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        check=False,
    )
    if not live.is_file():
        sys.exit(f'the live trial left no bag: {test}, {ppr} PPR, trial {trial}, nav:={nav}')
    run_trial(plan_of(test, ppr, trial, nav, str(lockstep)), ROBOT, load_robot_params(CONFIG), 'minimal')
    return live, lockstep


def _counts(bag: Path) -> Dict[int, List[int]]:
    """Both counters by stamp."""
    counts = {}
    with AnyReader([bag]) as reader:
        connections = [connection for connection in reader.connections if connection.topic == topics.ENCODER_PULSE]
        for connection, _, raw in reader.messages(connections):
            message = reader.deserialize(raw, connection.msgtype)
            stamp = message.header.stamp
            counts[stamp.sec * NANOSECONDS_PER_SECOND + stamp.nanosec] = message.pulses.tolist()
    return counts


def _errors(bag: Path) -> np.ndarray:
    """(4, 3): final errors by source, in mm and degrees."""
    errors = goal_errors(read_trial(bag))
    return np.array([errors[source] for source in PoseSource]) * UNITS


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog='example: source .ws/devel/setup.bash && '
        '.venv/bin/python test/benchmark/live_and_lockstep.py --trials 10 --tests SMT',
    )
    parser.add_argument('--scripted', nargs='*', default=['SL', 'SMT'])
    parser.add_argument('--tests', nargs='*', default=['SL', 'SMT', 'DLD'])
    parser.add_argument('--ppr', nargs='+', type=COUNT, default=[40, 4096])
    parser.add_argument('--trials', type=COUNT, default=10)
    parser.add_argument('--rtf', type=float, default=0.0)
    return parser.parse_args()


if __name__ == '__main__':
    main()
