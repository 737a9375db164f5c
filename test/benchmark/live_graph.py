#!/usr/bin/env python3
"""How fast the live graph runs with rtf:=0, at one core and at two, and whether its bag is whole.

Beside it the simulator alone and PyBullet's bare stepping, which is the limit. Needs the sourced
workspace. The stopwatch reads /clock twice a second from outside, not pinned to the graph's cores.
"""

from __future__ import annotations

import argparse
import math
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Dict, List, NamedTuple, Tuple

import numpy as np
from bare_stepping import BARE, LIMITS_PHYSICS, bare_stepping_s
from checkout import ROOT, print_header
from counts import COUNT
from measured_drive import cruise_costs_us, new_simulator, read_test, real_time_factor
from plans import plan_of
from ratios import Ratio, add_json, print_ratios, write_ratios
from rosbags.highlevel import AnyReader
from sourced import ADVICE, is_sourced
from tabulate import tabulate

from diff_encoder_sim.trials.robot_params import load_robot_params
from diff_encoder_sim.trials.scripted_drive import ScriptedDrive

REPORT_PERIOD_NS = 50_000_000
STARTED_S = 1.0  # of simulated time: the graph is connected and in its stride
TIME_LIMIT_S = 600.0  # of wall time, for one run
POLL_PERIOD_S = 0.5
BARE_S, BARE_REPEATS = 20.0, 3  # simulated, and how often
CORES = {'1 core': '0', '2 cores': '0,1'}
# How many times the bare stepping the graph may take: 26.4 times real time (1.5 times what it was when this limit was
# set) where bare stepping had 170.
MOST = {('scripted', '2 cores'): 6.4}


class Run(NamedTuple):
    """One live trial."""

    real_time_factor: float
    processor_ms: float  # of all nodes for each simulated second
    expected: int  # encoder samples: one for each 50 ms of /joint_states
    recorded: int
    is_odom_one_for_one: bool
    gaps: int  # steps of the encoder's stamps other than 50 ms


class Reading(NamedTuple):
    """Of the clocks at one time [s]."""

    wall_s: float
    sim_s: float
    processor_s: float  # of all nodes


def main() -> None:
    """Measure and print the table."""
    arguments = _arguments()
    check_sourced()
    print_header(
        f'Live graph: trial.launch test:={arguments.test} nav:={arguments.nav} rtf:=0, best of {arguments.repeats} runs'
    )
    test = read_test(arguments.test)
    simulator = new_simulator(test, LIMITS_PHYSICS)
    tick_us, _ = cruise_costs_us(simulator, test)
    simulator.close()
    bare_factor = _bare_factor(arguments.test)
    runs: Dict[str, List[Run]] = {}
    with tempfile.TemporaryDirectory() as folder:
        master = start_master(Path(folder))
        try:
            for name in (name for _ in range(arguments.repeats) for name in arguments.cores):
                runs.setdefault(name, []).append(
                    _trial(CORES[name], arguments, ScriptedDrive(test).duration_s, Path(folder))
                )
        finally:
            stop(master)
    _print_table(real_time_factor(tick_us), bare_factor, runs)
    # A trial that failed has stopped this script already; a lost sample is in the table.
    ratios = [ratio for name, several in runs.items() for ratio in _ratios(arguments, name, several, bare_factor)]
    print_ratios(ratios)
    write_ratios(arguments.json, ratios)


def _ratios(arguments: argparse.Namespace, cores: str, runs: List[Run], bare_factor: float) -> List[Ratio]:
    trial = f'{arguments.test} live, {arguments.nav}, {cores}'
    return [
        Ratio(
            f'{trial}, wall time',
            BARE,
            [bare_factor / run.real_time_factor for run in runs],
            MOST.get((arguments.nav, cores)),
        ),
        Ratio(f'{trial}, processor time of all nodes', BARE, [1e-3 * run.processor_ms * bare_factor for run in runs]),
    ]


def _bare_factor(test: str) -> float:
    """Return how many times real time PyBullet's bare stepping has: the best of some."""
    plan, params = plan_of(test, 90, 1, 'scripted'), load_robot_params(ROOT / 'config')
    return BARE_S / min(bare_stepping_s(plan, params, BARE_S) for _ in range(BARE_REPEATS))


def _print_table(tick: float, bare: float, runs: Dict[str, List[Run]]) -> None:
    """Print real-time factors: of Simulator.tick alone, of bare stepping, and of the live graph."""
    rows = [[BARE, f'{bare:.1f}', '1'], ['Simulator.tick alone', f'{tick:.1f}', f'1 / {bare / tick:.2f}']]
    for name, several in runs.items():
        best = max(run.real_time_factor for run in several)
        lost = [run.expected - run.recorded for run in several]
        rows.append(
            [
                f'live graph, {name}',
                f'{best:.1f}',
                f'1 / {bare / best:.1f}',
                ', '.join(f'{run.real_time_factor:.1f}' for run in several),
                f'{min(run.processor_ms for run in several):.0f}',
                several[0].expected,
                sum(lost),
                'yes' if all(run.is_odom_one_for_one for run in several) else 'NO',
                sum(run.gaps for run in several),
            ]
        )
    print(
        tabulate(
            rows,
            [
                '',
                'real-time\nfactor',
                'of the\nlimit',
                'each run',
                'processor [ms]\nper simulated s',
                'encoder samples\nexpected',
                'lost,\nall runs',
                '/odom one\nfor one',
                'gaps in\n50 ms',
            ],
            disable_numparse=True,
            colalign=('left',) + ('right',) * 8,
        )
        + '\n'
    )


def _trial(cores: str, arguments: argparse.Namespace, drive_s: float, folder: Path) -> Run:
    bag = folder / 'trial.bag'
    if bag.exists():
        bag.unlink()
    launch = subprocess.Popen(
        [
            'taskset',
            '-c',
            cores,
            'roslaunch',
            'diff_encoder_sim',
            'trial.launch',
            f'test:={arguments.test}',
            f'nav:={arguments.nav}',
            'rtf:=0',
            f'bag:={bag}',
        ],
        start_new_session=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    try:
        readings = _clock_readings(launch)
        _, errors = launch.communicate(timeout=30)
    finally:
        stop(launch)
    if launch.returncode != 0 or not bag.is_file():
        sys.exit(f'the trial failed with status {launch.returncode}:\n{errors.decode()[-2000:]}')
    driving = [reading for reading in readings if STARTED_S < reading.sim_s < drive_s]
    if len(driving) < 2:
        sys.exit('the trial was over before its clock could be read twice; take a longer test')
    first, last = driving[0], driving[-1]
    simulated_s = last.sim_s - first.sim_s
    processor_ms = 1e3 * (last.processor_s - first.processor_s) / simulated_s
    return Run(simulated_s / (last.wall_s - first.wall_s), processor_ms, *_check_bag(bag))


def _clock_readings(launch: subprocess.Popen) -> List[Reading]:
    """The clocks now and then until the launch ends."""
    import rospy
    from rosgraph_msgs.msg import Clock

    readings, deadline_s = [], time.monotonic() + TIME_LIMIT_S
    while launch.poll() is None:
        if time.monotonic() > deadline_s:
            sys.exit(f'the trial is not over after {TIME_LIMIT_S:.0f} s')
        try:
            clock = rospy.wait_for_message('/clock', Clock, timeout=POLL_PERIOD_S).clock
            readings.append(Reading(time.monotonic(), clock.to_sec(), processor_s(launch.pid)))
            time.sleep(POLL_PERIOD_S)
        except rospy.ROSException:
            pass  # not up yet, or already gone
    return readings


def processor_s(root: int) -> float:
    """Return the processor time so far [s] of a process and of what it has started, as long as they run."""
    children: Dict[int, List[int]] = {}
    ticks: Dict[int, int] = {}
    for path in Path('/proc').glob('[0-9]*/stat'):
        try:
            fields = path.read_text().rpartition(')')[2].split()
        except OSError:
            continue  # ended meanwhile
        children.setdefault(int(fields[1]), []).append(int(path.parent.name))
        ticks[int(path.parent.name)] = int(fields[11]) + int(fields[12])
    family = [root]
    for process in family:
        family += children.get(process, [])
    return sum(ticks.get(process, 0) for process in family) / os.sysconf('SC_CLK_TCK')


def _check_bag(bag: Path) -> Tuple[int, int, bool, int]:
    """Samples expected and recorded, whether /odom answers each, and gaps between them."""
    stamps_ns: Dict[str, List[int]] = {'/joint_states': [], '/encoder_pulse': [], '/odom': []}
    with AnyReader([bag]) as reader:
        wanted = [connection for connection in reader.connections if connection.topic in stamps_ns]
        for connection, _, raw in reader.messages(wanted):
            stamp = reader.deserialize(raw, connection.msgtype).header.stamp
            stamps_ns[connection.topic].append(stamp.sec * 10**9 + stamp.nanosec)
    joints, samples = stamps_ns['/joint_states'], stamps_ns['/encoder_pulse']
    expected = joints[-1] // REPORT_PERIOD_NS - math.ceil(joints[0] / REPORT_PERIOD_NS) + 1
    gaps = int(np.count_nonzero(np.diff(samples) != REPORT_PERIOD_NS))
    return expected, len(samples), samples == stamps_ns['/odom'], gaps


def check_sourced() -> None:
    """End with one line where roslaunch or this package is not to be found."""
    if not is_sourced():
        sys.exit(ADVICE)
    if not shutil.which('taskset'):
        sys.exit('taskset is missing: apt install util-linux')


def start_master(folder: Path) -> subprocess.Popen:
    """A master on a port of its own, and this process as a node that no clock governs."""
    with socket.socket() as probe:
        probe.bind(('127.0.0.1', 0))
        port = probe.getsockname()[1]
    os.environ.update(
        ROS_MASTER_URI=f'http://127.0.0.1:{port}',
        ROS_IP='127.0.0.1',
        ROS_HOME=str(folder / 'ros'),
        ROS_LOG_DIR=str(folder / 'log'),
    )
    os.environ.pop('ROS_HOSTNAME', None)
    # Nodes start with "env python3": it must be this one, which has their libraries.
    os.environ['PATH'] = f'{Path(sys.executable).parent}:{os.environ["PATH"]}'
    master = subprocess.Popen(
        ['roscore', '-p', str(port)], start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    import rosgraph
    import rospy

    while not rosgraph.is_master_online():
        if master.poll() is not None:
            sys.exit(f'roscore ended with status {master.returncode}')
        time.sleep(0.1)
    rospy.init_node(
        'live_graph_benchmark', anonymous=True, disable_rostime=True, disable_rosout=True, disable_signals=True
    )
    return master


def stop(process: subprocess.Popen) -> None:
    """Ask roslaunch to end, so that it ends its nodes; insist if it does not."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
        if process.poll() is not None:
            return
        process.send_signal(number)
        try:
            process.wait(timeout=20)
        except subprocess.TimeoutExpired:
            continue


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog='example: source .ws/devel/setup.bash && .venv/bin/python test/benchmark/live_graph.py --repeats 3',
    )
    parser.add_argument('--test', default='SL', choices=('SL', 'SMT'))
    parser.add_argument('--nav', default='scripted', choices=('scripted', 'embedded'))
    parser.add_argument('--cores', nargs='+', default=list(CORES), choices=list(CORES))
    parser.add_argument('--repeats', type=COUNT, default=3, help='runs, of which the best counts')
    add_json(parser)
    return parser.parse_args()


if __name__ == '__main__':
    main()
