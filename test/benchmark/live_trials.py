#!/usr/bin/env python3
"""Navigated trials on the live graph, one cell after another: whether each ends at its goal, and how
far from it its pose estimate and its true pose are. Needs the sourced workspace."""

from __future__ import annotations

import argparse
import math
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import List, Optional

from checkout import print_header
from counts import COUNT
from live_graph import check_sourced, start_master, stop
from tabulate import tabulate

from diff_encoder_sim.analysis.bag_dataset import goal_errors
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_recording import read_trial

TIME_LIMIT_S = 900.0  # of wall time, for one trial
CORES = '0,1'


def main() -> None:
    """Run the cells and print the table; ends with status 1 if one failed."""
    arguments = _arguments()
    check_sourced()
    print_header(f'Live navigated trials, rtf:={arguments.rtf:g}, cores {CORES}')
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        master = start_master(Path(folder))
        try:
            for test in arguments.tests:
                for ppr in arguments.ppr:
                    rows.append([test, ppr, *_trial(test, ppr, arguments, Path(folder))])
                    print(*rows[-1], flush=True)
        finally:
            stop(master)
    print()
    print(
        tabulate(
            rows,
            [
                'test',
                'PPR',
                'outcome',
                'simulated\n[s]',
                'x real time,\nwith start',
                '/global_pose\nto goal [mm]',
                '\n[deg]',
                '/world_pose\nto goal [mm]',
                '\n[deg]',
                'warnings',
            ],
            disable_numparse=True,
            stralign='right',
        )
    )
    sys.exit(any(row[2] != 'succeeded' for row in rows))


def _trial(test: str, ppr: int, arguments: argparse.Namespace, folder: Path) -> List[object]:
    bag, begin_s = folder / f'{test}_{ppr}.bag', time.monotonic()
    launch = subprocess.Popen(
        [
            'taskset',
            '-c',
            CORES,
            'roslaunch',
            'diff_encoder_sim',
            'trial.launch',
            'nav:=embedded',
            f'test:={test}',
            f'ppr:={ppr}',
            f'rtf:={arguments.rtf}',
            f'trial:={arguments.trial}',
            f'bag:={bag}',
        ],
        start_new_session=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    try:
        output, _ = launch.communicate(timeout=TIME_LIMIT_S)
    except subprocess.TimeoutExpired:
        stop(launch)
        return [f'not over after {TIME_LIMIT_S:.0f} s of wall time']
    wall_s = time.monotonic() - begin_s
    complaints = [line for line in output.decode().splitlines() if 'WARN' in line or 'ERR' in line]
    if arguments.verbose:
        print('\n'.join(complaints))
    if not bag.is_file():
        return [f'no bag; roslaunch ended with status {launch.returncode}']
    recording = read_trial(bag)
    errors = goal_errors(recording)
    stamps_ns = recording.poses[topics.WORLD_POSE].stamps_ns
    driven_s = float(stamps_ns[-1] - stamps_ns[0]) * 1e-9
    bag.unlink()
    return [
        recording.outcome.text,
        f'{driven_s:.1f}',
        f'{driven_s / wall_s:.2f}',
        *_distance_and_angle(errors[PoseSource.GLOBAL]),
        *_distance_and_angle(errors[PoseSource.WORLD]),
        len(complaints),
    ]


def _distance_and_angle(error: Optional[Pose2D]) -> List[str]:
    if error is None:
        return ['-', '-']
    return [f'{1e3 * math.hypot(error[0], error[1]):.0f}', f'{abs(math.degrees(error[2])):.1f}']


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog='example: source .ws/devel/setup.bash && .venv/bin/python test/benchmark/live_trials.py --rtf 3',
    )
    parser.add_argument('--tests', nargs='+', default=['SL', 'SMT', 'DLD'])
    parser.add_argument('--ppr', nargs='+', type=COUNT, default=[40, 90, 1024, 4096])
    parser.add_argument('--rtf', type=float, default=1.0)
    parser.add_argument('--trial', type=COUNT, default=1, help='number of the trial: its seed')
    parser.add_argument('--verbose', action='store_true', help='print the warnings')
    return parser.parse_args()


if __name__ == '__main__':
    main()
