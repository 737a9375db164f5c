#!/usr/bin/env python3
"""How much faster than real time `reencode` is, by PPR and with all errors of an encoder; that its memory is flat."""

from __future__ import annotations

import argparse
import multiprocessing
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import List, NamedTuple

import yaml
from checkout import ROOT, print_header
from core_costs import FULL, REPORT
from counts import COUNT
from tabulate import tabulate

from diff_encoder_sim.base.se2 import Pose2D, move_along_arc
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.pose_messages import encode_pose_stamped, encode_tf, encode_transform
from diff_encoder_sim.drives.sensor_messages import encode_clock, encode_joint_state
from diff_encoder_sim.drives.trial_bag import TrialBag
from diff_encoder_sim.simulation.state import JointStates

JOINTS = ('left_wheel_joint', 'right_wheel_joint')
TICK_NS = 10_000_000
WHEEL_RADIUS_M, WHEEL_SEPARATION_M = 0.1, 0.4
LEFT_RADPS, RIGHT_RADPS = 4.0, 4.1


class Run(NamedTuple):
    """One run of the command."""

    processor_s: float
    peak_mib: float


def main() -> None:
    """Print the table."""
    arguments = _arguments()
    print_header(
        f'reencode: wheel angles at 100 Hz, truth at 20 Hz, clock and transforms that are '
        f'passed over; best of {arguments.repeats} runs'
    )
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        # What does not depend on the drive: the interpreter, and what it imports.
        base = _best(folder, _drive(folder / 'short.bag', 1), ['--ppr', '90'], False, arguments.repeats)
        full = _encoder_file(folder / 'full.yaml')
        for hours in arguments.hours:
            bag = _drive(folder / f'{hours:g}h.bag', int(hours * 3600))
            for label, count, given in (
                ('90 PPR', 1, ['--ppr', '90']),
                ('40, 90, 1024, 4096 PPR', 4, ['--ppr', '40', '90', '1024', '4096']),
                ('all errors and faults, M/T', 1, ['--encoder', str(full)]),
            ):
                for is_written in (False, True):
                    run = _best(folder, bag, given, is_written, arguments.repeats)
                    drive_s = (run.processor_s - base.processor_s) / count
                    rows.append(
                        [
                            f'{hours:g}',
                            label,
                            'yes' if is_written else 'no',
                            f'{run.processor_s:.1f}',
                            f'{hours * 3600 / drive_s:.0f}',
                            f'{run.peak_mib:.0f}',
                        ]
                    )
            bag.unlink()
    print(
        tabulate(
            rows,
            [
                'drive [h]',
                'encoders',
                'bags\nwritten',
                'processor\n[s]',
                'times real time,\nper encoder',
                'peak\nmemory [MiB]',
            ],
            disable_numparse=True,
            colalign=('right', 'left') + ('right',) * 4,
        )
    )
    print(f'\nThe start takes {base.processor_s:.2f} s, which the factor leaves out.')


def _drive(path: Path, duration_s: int) -> Path:
    """A bag, written in a process of its own: a command's peak memory begins with its parent's."""
    writer = multiprocessing.get_context('spawn').Process(target=_write_drive, args=(path, duration_s))
    writer.start()
    writer.join()
    return path


def _write_drive(path: Path, duration_s: int) -> None:
    """A circle, and the truth at every report."""
    pose = Pose2D(0.0, 0.0, 0.0)
    travel_m = 0.5 * (LEFT_RADPS + RIGHT_RADPS) * WHEEL_RADIUS_M * 0.05
    turn_rad = (RIGHT_RADPS - LEFT_RADPS) * WHEEL_RADIUS_M / WHEEL_SEPARATION_M * 0.05
    with TrialBag(path, 'full') as bag:
        for tick in range(duration_s * 100):
            now_ns = tick * TICK_NS
            bag.write(topics.CLOCK, topics.SIMULATOR_NODE, encode_clock(now_ns), now_ns)
            bag.write(
                topics.JOINT_STATES,
                topics.SIMULATOR_NODE,
                encode_joint_state(
                    JointStates(
                        now_ns, JOINTS, (LEFT_RADPS * tick / 100, RIGHT_RADPS * tick / 100), (LEFT_RADPS, RIGHT_RADPS)
                    )
                ),
                now_ns,
            )
            if tick % 2 == 0:
                bag.write(
                    topics.TF,
                    topics.STATE_PUBLISHER_NODE,
                    encode_tf(encode_transform(pose, now_ns, 'base_link', 'left_wheel')),
                    now_ns,
                )
            if tick % 5 == 0:
                bag.write(topics.WORLD_POSE, topics.WORLD_POSE_NODE, encode_pose_stamped(pose, now_ns, 'map'), now_ns)
                pose = move_along_arc(pose, travel_m, turn_rad)


def _encoder_file(path: Path) -> Path:
    """The full chain of core_costs.py, as a file of `--encoder`."""
    faults = {key: value for key, value in FULL['faults'].items() if not key.startswith('dead')}
    config = {'report': REPORT, 'velocity_method': 'MT'}
    encoder = {'name': 'full', 'source': ['core_costs.py'], 'price': 'none', 'config': config}
    path.write_text(yaml.safe_dump({**encoder, 'encoder': {**FULL, 'faults': faults}}))
    return path


def _best(folder: Path, bag: Path, encoders: List[str], is_written: bool, repeats: int) -> Run:
    runs = [_run(folder, bag, encoders, is_written) for _ in range(repeats)]
    return Run(min(run.processor_s for run in runs), max(run.peak_mib for run in runs))


def _run(folder: Path, bag: Path, encoders: List[str], is_written: bool) -> Run:
    out = folder / f'out-{time.monotonic_ns()}'
    command = [
        sys.executable,
        str(ROOT / 'scripts' / 'reencode'),
        str(bag),
        *encoders,
        *(['--out', str(out)] if is_written else []),
    ]
    # Without a sourced workspace, too.
    paths = os.pathsep.join([str(ROOT / 'src'), os.environ.get('PYTHONPATH', '')])
    environment = {**os.environ, 'PYTHONPATH': paths}
    quiet = {'stdout': subprocess.DEVNULL, 'stderr': subprocess.DEVNULL}
    process = subprocess.Popen(command, env=environment, **quiet)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.WEXITSTATUS(status)
    assert process.returncode == 0, command
    for path in out.glob('*'):
        path.unlink()
    return Run(usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog='example: .venv/bin/python test/benchmark/reencode.py --hours 0.25 1 10',
    )
    parser.add_argument(
        '--hours', type=float, nargs='+', default=[0.1, 0.5], help='lengths of the drives (default: %(default)s)'
    )
    parser.add_argument('--repeats', type=COUNT, default=2, help='runs (default: %(default)s)')
    return parser.parse_args()


if __name__ == '__main__':
    main()
