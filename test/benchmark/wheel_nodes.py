#!/usr/bin/env python3
"""How many joint states a second encoder and odometry keep up with, live, both nodes on one core.

Each message is reported; the messages that must come are those of the core's components, fed alike. The rate is raised
until reports are late by more than 0.1 s when the last message is sent: up to 1 kHz they may not be, and none may be
lost at any rate. What both nodes spend on a message is compared with what the core's components spend on it, which
nodes add rospy to. Needs the sourced workspace.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import threading
import time
import warnings
from pathlib import Path
from typing import Callable, Dict, List, NamedTuple

from checkout import print_header
from core_costs import CHAINS, JOINTS, WHEEL_SPEED_RADPS
from counts import COUNT
from live_graph import check_sourced, start_master, stop
from ratios import Ratio, add_json, print_ratios, write_ratios
from tabulate import tabulate

from diff_encoder_sim.base.bounds import Between
from diff_encoder_sim.base.command_line import number_within
from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder

CORE = '0'
START_NS = 10**9
LATE_S = 0.1
CONNECTED_AFTER_S = 2.0
# 30 % of the core, where the nodes took 26 % with an ideal encoder: 8 to 9.3 times what the components do.
LIMITS_RATE_HZ, MOST = 1000.0, 10.0
RATES_HZ = [1000.0, 2000.0, 2500.0, 4000.0, 5000.0]
RATE, DURATION = Between(1.0, 1e5, 'Hz'), Between(0.1, 3600.0, 's')
NODES = ('gz_diff_encoder_node', 'gz_diff_odom_node')


class Run(NamedTuple):
    """One drive at one rate."""

    rate_hz: float  # asked for
    expected: int  # messages on /odom
    lost: int
    sent_hz: float  # which may be less
    late_s: float  # the last one, after the last message was sent
    share: float  # of the core's time, both nodes
    times_components: float  # their processor time, in units of that of the core's components alone


def main() -> None:
    """Raise the rate for each chain, and print the table; the exit status is 1 where the nodes do not keep up."""
    arguments = _arguments()
    check_sourced()
    print_header(
        f'Encoder and odometry node on one core: joint states and reports at one rate for {arguments.seconds:g} s'
    )
    with tempfile.TemporaryDirectory() as folder:
        master = start_master(Path(folder))
        try:
            runs = {name: _runs(chain, arguments) for name, chain in CHAINS.items()}
        finally:
            stop(master)
    _print_table(runs)
    ratios = _ratios(runs)
    print_ratios(ratios)
    write_ratios(arguments.json, ratios)
    sys.exit('\n'.join(faults(runs)) or 0)


def _runs(chain: Dict, arguments: argparse.Namespace) -> List[Run]:
    """Drive at each rate, several times at that of the limits, until a node falls behind."""
    # Reports that come after others are ignored, on purpose: at 1 kHz most of a poor line.
    params = {**chain, 'report': {'latency': 0.01}} if chain else {}
    runs: List[Run] = []
    for rate_hz in arguments.rates:
        repeats = arguments.repeats if rate_hz == LIMITS_RATE_HZ else 1
        runs += [_run({'rate': rate_hz, **params}, rate_hz, arguments.seconds) for _ in range(repeats)]
        if runs[-1].late_s > LATE_S:
            break
    return runs


def _print_table(runs: Dict[str, List[Run]]) -> None:
    rows = [
        [
            name,
            f'{run.rate_hz:g}',
            f'{run.sent_hz:.0f}',
            run.expected,
            run.lost,
            f'{1e3 * run.late_s:.0f}',
            f'{run.share:.0%}',
        ]
        for name, several in runs.items()
        for run in several
    ]
    headers = [
        'encoder',
        'rate\n[Hz]',
        'sent\n[Hz]',
        '/odom\nexpected',
        'lost',
        'late at the\nend [ms]',
        'of the\ncore',
    ]
    print(tabulate(rows, headers, disable_numparse=True, colalign=('left',) + ('right',) * 6) + '\n')


def _ratios(runs: Dict[str, List[Run]]) -> List[Ratio]:
    times = {
        name: [run.times_components for run in several if run.rate_hz == LIMITS_RATE_HZ]
        for name, several in runs.items()
    }
    return [
        Ratio(f'both nodes, {name}, {LIMITS_RATE_HZ:g} Hz', 'components', rounds, MOST)
        for name, rounds in times.items()
        if rounds
    ]


def faults(runs: Dict[str, List[Run]]) -> List[str]:
    """Return what must not be: a lost message at any rate, or a node behind at the limits' rate or a lower one."""
    found = []
    for name, run in ((name, run) for name, several in runs.items() for run in several):
        where = f'wheel_nodes.py: {name}, {run.rate_hz:g} Hz'
        if run.lost:
            found.append(f'{where}: {run.lost} of {run.expected} messages on /odom lost; allowed: none')
        if run.late_s > LATE_S and run.rate_hz <= LIMITS_RATE_HZ:
            found.append(f'{where}: the last message late by {run.late_s:.2f} s; allowed: {LATE_S:g} s')
    return found


def _run(params: Dict, rate_hz: float, seconds: float) -> Run:
    import rospy
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import JointState

    began_s = time.process_time()
    expected_ns = _expected_stamps_ns(params, rate_hz, seconds)
    components_s = time.process_time() - began_s
    seen_ns: List[int] = []
    everything = threading.Event()

    def take(message: Odometry) -> None:
        seen_ns.append(message.header.stamp.to_nsec())
        if seen_ns[-1] >= expected_ns[-1]:
            everything.set()

    for name in NODES:
        rospy.set_param(name, params)
    nodes = [_node(name) for name in NODES]
    listener = rospy.Subscriber('/odom', Odometry, take, tcp_nodelay=True)
    try:
        joints = _publisher(JointState)
        _wait(lambda: joints.get_num_connections() == 1 and listener.get_num_connections() == 1)
        time.sleep(CONNECTED_AFTER_S)  # the nodes among themselves
        busy_s = _processor_s(nodes)
        began_s = time.monotonic()
        _send(joints, rate_hz, seconds)
        sent_s = time.monotonic()
        everything.wait(timeout=60.0)
        ended_s = time.monotonic()
        spent_s = _processor_s(nodes) - busy_s
        sent_hz = round(rate_hz * seconds) / (sent_s - began_s)
        lost = len(set(expected_ns) - set(seen_ns))
        share = spent_s / (ended_s - began_s)
        return Run(rate_hz, len(expected_ns), lost, sent_hz, ended_s - sent_s, share, spent_s / components_s)
    finally:
        listener.unregister()
        joints.unregister()
        for node in nodes:
            stop(node)


def _expected_stamps_ns(params: Dict, rate_hz: float, seconds: float) -> List[int]:
    encoder = ReportingEncoder(EncoderParams.from_mapping(params, 'encoder'))
    of_odometry = {key: value for key, value in params.items() if key in OdometryParams.model_fields}
    odometry = WheelOdometry(OdometryParams.from_mapping(of_odometry, 'odometry'))
    stamps_ns = []
    for index in range(round(rate_hz * seconds)):
        for sample in encoder.update(_stamp_ns(index, rate_hz), JOINTS, _angles_rad(index, rate_hz)):
            if odometry.update(*sample) is not None:
                stamps_ns.append(sample.stamp_ns)
    return stamps_ns


def _stamp_ns(index: int, rate_hz: float) -> int:
    return START_NS + round(index * 1e9 / rate_hz)


def _angles_rad(index: int, rate_hz: float) -> List[float]:
    return [0.01 + WHEEL_SPEED_RADPS * index / rate_hz] * 2


def _send(joints, rate_hz: float, seconds: float) -> None:
    import rospy
    from sensor_msgs.msg import JointState

    start_s = time.monotonic()
    for index in range(round(rate_hz * seconds)):
        ahead_s = start_s + index / rate_hz - time.monotonic()
        if ahead_s > 0.0:
            time.sleep(ahead_s)
        message = JointState(name=JOINTS, position=_angles_rad(index, rate_hz))
        stamp_ns = _stamp_ns(index, rate_hz)
        message.header.stamp = rospy.Time(stamp_ns // 10**9, stamp_ns % 10**9)
        joints.publish(message)


def _node(name: str) -> subprocess.Popen:
    path = subprocess.run(['catkin_find', 'diff_encoder_sim', name], stdout=subprocess.PIPE, text=True, check=True)
    command = ['taskset', '-c', CORE, path.stdout.splitlines()[0], f'__name:={name}']
    return subprocess.Popen(command, start_new_session=True, stdout=subprocess.DEVNULL)


def _publisher(kind):
    import rospy

    with warnings.catch_warnings():
        warnings.simplefilter('ignore', SyntaxWarning)
        # Without a queue `publish` returns when the message is in the socket: this process loses none.
        return rospy.Publisher('/joint_states', kind, queue_size=None, tcp_nodelay=True)


def _processor_s(nodes: List[subprocess.Popen]) -> float:
    """Return the processor time of the nodes so far [s]: user and system."""
    ticks = 0
    for node in nodes:
        fields = Path(f'/proc/{node.pid}/stat').read_text().rpartition(')')[2].split()
        ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf('SC_CLK_TCK')


def _wait(condition: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + 30.0
    while not condition():
        if time.monotonic() > deadline_s:
            sys.exit('the nodes do not connect')
        time.sleep(0.05)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog='example: source .ws/devel/setup.bash && .venv/bin/python test/benchmark/wheel_nodes.py --seconds 10',
    )
    parser.add_argument('--rates', type=number_within(RATE), nargs='+', default=RATES_HZ, help='[Hz]')
    parser.add_argument('--seconds', type=number_within(DURATION), default=10.0, help='of joint states at each rate')
    parser.add_argument('--repeats', type=COUNT, default=3, help=f'runs at {LIMITS_RATE_HZ:g} Hz')
    add_json(parser)
    return parser.parse_args()


if __name__ == '__main__':
    main()
