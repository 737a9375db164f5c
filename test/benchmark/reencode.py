#!/usr/bin/env python3
"""How much faster than real time `reencode` is, by PPR and with all errors of an encoder, and its memory."""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import List, NamedTuple

import yaml
from bench import ROOT, package_environment, parser, print_header, print_table

from diff_encoder_sim.base.se2 import Pose2D, move_along_arc
from diff_encoder_sim.drives import message_encoders, topics
from diff_encoder_sim.drives.trial_bag import TrialBag
from diff_encoder_sim.simulation.state import JointStates

JOINTS = ('left_wheel_joint', 'right_wheel_joint')
TICK_NS = 10_000_000
WHEEL_RADIUS_M, WHEEL_SEPARATION_M = 0.1, 0.4
LEFT_RADPS, RIGHT_RADPS = 4.0, 4.1
# On the motor, with play, errors of the sensor, faults, and a poor line.
ERRORS = yaml.safe_load((ROOT / 'test' / 'rostest' / 'data' / 'real_encoder.yaml').read_text())['encoder']
REPORT = {'jitter': 0.002, 'latency': 0.01, 'latency_spread': 0.005, 'lost': 0.01, 'repeated': 0.01}
ABOUT = {'manufacturer': 'a', 'part': 'full', 'type': 'all errors', 'price': 'none'}
FULL = {**ABOUT, 'source': ['test/benchmark/reencode.py'], 'encoder': ERRORS}
FULL['config'] = {'report': REPORT, 'velocity_method': 'MT'}


class Run(NamedTuple):
    processor_s: float
    peak_mib: float


def main() -> None:
    made = parser(__doc__, repeats=2)
    made.add_argument('--hours', type=float, nargs='+', default=[0.1, 0.5], help='lengths of the drives')
    options = made.parse_args()
    print_header(f'reencode: wheel angles at 100 Hz, truth at 20 Hz, other topics; best of {options.repeats} runs')
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        full = folder / 'full.yaml'
        full.write_text(yaml.safe_dump(FULL))
        start = _best(folder, _drive(folder / 'short.bag', 1), ['--ppr', '90'], False, options.repeats)
        for hours in options.hours:
            bag = _drive(folder / f'{hours:g}h.bag', int(hours * 3600))
            for given in (['--ppr', '90'], ['--ppr', '40', '90', '1024', '4096'], ['--encoder', str(full)]):
                for is_written in (False, True):
                    run = _best(folder, bag, given, is_written, options.repeats)
                    factor = hours * 3600 * (len(given) - 1) / (run.processor_s - start.processor_s)
                    label, written = ' '.join(given[1:]), 'yes' if is_written else 'no'
                    rows.append([Path(label).stem, hours, written, run.processor_s, f'{factor:.0f}', run.peak_mib])
            bag.unlink()
    heads = ['drive [h]', 'bags written', 'processor [s]', 'times real time, per encoder', 'peak memory [MiB]']
    print_table(rows, ['encoders', *heads])
    print(f'The start takes {start.processor_s:.2f} s, which the factor leaves out.')


def _drive(path: Path, duration_s: int) -> Path:
    """Write a bag in a separate process: a command's peak memory begins with its parent's."""
    writer = multiprocessing.get_context('spawn').Process(target=_write_drive, args=(path, duration_s))
    writer.start()
    writer.join()
    return path


def _write_drive(path: Path, duration_s: int) -> None:
    """Write a circle, and the truth at each report."""
    pose = Pose2D(0.0, 0.0, 0.0)
    travel_m = 0.5 * (LEFT_RADPS + RIGHT_RADPS) * WHEEL_RADIUS_M * 0.05
    turn_rad = (RIGHT_RADPS - LEFT_RADPS) * WHEEL_RADIUS_M / WHEEL_SEPARATION_M * 0.05
    with TrialBag(path, 'full') as bag:
        for tick in range(duration_s * 100):
            now_ns, angles_rad = tick * TICK_NS, (LEFT_RADPS * tick / 100, RIGHT_RADPS * tick / 100)
            bag.publish(topics.CLOCK, topics.SIMULATOR_NODE, now_ns, message_encoders.encode_clock, now_ns)
            joints = JointStates(now_ns, JOINTS, angles_rad, (LEFT_RADPS, RIGHT_RADPS))
            encode = message_encoders.encode_joint_state
            bag.publish(topics.JOINT_STATES, topics.SIMULATOR_NODE, now_ns, encode, joints)
            if tick % 2 == 0:
                transform = message_encoders.encode_transform(pose, now_ns, 'base_link', 'left_wheel')
                bag.publish(topics.TF, topics.STATE_PUBLISHER_NODE, now_ns, message_encoders.encode_tf, transform)
            if tick % 5 == 0:
                encode, about = message_encoders.encode_pose_stamped, (pose, now_ns, 'map')
                bag.publish(topics.WORLD_POSE, topics.WORLD_POSE_NODE, now_ns, encode, *about)
                pose = move_along_arc(pose, travel_m, turn_rad)


def _best(folder: Path, bag: Path, encoders: List[str], is_written: bool, repeats: int) -> Run:
    runs = [_run(folder, bag, encoders, is_written) for _ in range(repeats)]
    return Run(min(run.processor_s for run in runs), max(run.peak_mib for run in runs))


def _run(folder: Path, bag: Path, encoders: List[str], is_written: bool) -> Run:
    out = folder / f'out-{time.monotonic_ns()}'
    command = [sys.executable, str(ROOT / 'scripts' / 'reencode'), str(bag), *encoders]
    command += ['--out', str(out)] if is_written else []
    quiet = {'stdout': subprocess.DEVNULL, 'stderr': subprocess.DEVNULL}
    process = subprocess.Popen(command, env=package_environment(), **quiet)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.WEXITSTATUS(status)
    assert process.returncode == 0, command
    for path in out.glob('*'):
        path.unlink()
    return Run(usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024)


if __name__ == '__main__':
    main()
