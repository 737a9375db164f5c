#!/usr/bin/env python3
"""What recording a trial in lockstep costs: each message made, serialised and written."""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path
from typing import Callable, List, NamedTuple

import numpy as np
from checkout import ROOT, print_header
from counts import COUNT
from tabulate import tabulate

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.pose_messages import (
    ModelStatesEncoder,
    encode_odometry,
    encode_pose_stamped,
    encode_pose_with_covariance,
    encode_spatial_transform,
    encode_tf,
    encode_transform,
)
from diff_encoder_sim.drives.sensor_messages import (
    encode_clock,
    encode_command,
    encode_encoder_pulse,
    encode_joint_state,
    encode_scan,
)
from diff_encoder_sim.drives.trial_bag import TrialBag
from diff_encoder_sim.drives.typestore import noetic_store
from diff_encoder_sim.simulation.state import BodyState, JointStates
from diff_encoder_sim.simulation.world import load_world
from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.report_link import EncoderSample

JOINTS = ('left_wheel_joint', 'right_wheel_joint')
WHEELS = ('left_wheel', 'right_wheel')
POSE = Pose2D(12.3, -1.2, 0.7)
QUAT_XYZW = (0.5, 0.5, 0.5, 0.5)
PERIOD_NS = 10_000_000


class Case(NamedTuple):
    """One publisher of a trial."""

    topic: str
    node: str
    rate_hz: int
    make: Callable[[int], bytes]  # of the time [ns]


def main() -> None:
    """Print the table."""
    arguments = _arguments()
    print_header(f'Cost of a recording: {arguments.messages} messages of each kind, best of {arguments.repeats} runs')
    rows, total_ms = [], 0.0
    for case in _cases():
        make_us = min(_make_us(case, arguments.messages) for _ in range(arguments.repeats))
        all_us = min(_record_us(case, arguments.messages) for _ in range(arguments.repeats))
        total_ms += all_us * case.rate_hz / 1000
        rows.append(
            [
                f'{case.topic} {case.node}',
                case.rate_hz,
                len(case.make(0)),
                f'{make_us:.1f}',
                f'{_rosbags_us(case, arguments.messages):.1f}',
                f'{all_us:.1f}',
                f'{all_us * case.rate_hz / 1000:.2f}',
            ]
        )
    count = sum(case.rate_hz for case in _cases())
    rows.append(['all', count, '', '', '', f'{1000 * total_ms / count:.1f}', f'{total_ms:.2f}'])
    print(
        tabulate(
            rows,
            [
                'topic, node',
                'per simulated\nsecond',
                'bytes',
                'made\n[us]',
                'rosbags\nalone [us]',
                'in the bag\n[us]',
                'ms per\nsimulated s',
            ],
            disable_numparse=True,
            colalign=('left', *['right'] * 6),
        )
    )
    print(
        f'\nProcessor time. "rosbags alone" is its serialiser without the making of the object; '
        f'"in the bag" is all\ntogether, index included. A bag by itself: '
        f'{_empty_bag_ms(arguments.repeats):.1f} ms.'
    )


def _cases() -> List[Case]:
    grid_scan = np.random.default_rng(1).uniform(0.2, 6.0, 1000)
    world = load_world(ROOT / 'worlds' / 'ros_logo.world')
    models = ModelStatesEncoder(world, 'alto')
    body = BodyState((12.3, -1.2, 0.0), QUAT_XYZW, (0.4, 0.1, 0.0), (0.0, 0.0, 0.3))
    odometry = WheelOdometry(OdometryParams())
    odometry.update(0, 0, 0)
    estimate = odometry.update(50_000_000, 3, 4)
    return [
        Case(topics.CLOCK, topics.SIMULATOR_NODE, 100, encode_clock),
        Case(
            topics.JOINT_STATES,
            topics.SIMULATOR_NODE,
            100,
            lambda now_ns: encode_joint_state(JointStates(now_ns, JOINTS, (1.2, 3.4), (4.5, 4.4))),
        ),
        Case(
            topics.TF,
            topics.STATE_PUBLISHER_NODE,
            50,
            lambda now_ns: encode_tf(
                *(encode_spatial_transform((0.0, 0.2, 0.1), QUAT_XYZW, now_ns, 'base_link', wheel) for wheel in WHEELS)
            ),
        ),
        Case(
            topics.TF,
            topics.ODOM_NODE,
            20,
            lambda now_ns: encode_tf(encode_transform(POSE, now_ns, 'odom', 'base_link')),
        ),
        Case(topics.TF, topics.AMCL_NODE, 10, lambda now_ns: encode_tf(encode_transform(POSE, now_ns, 'map', 'odom'))),
        Case(topics.MODEL_STATES, topics.SIMULATOR_NODE, 20, lambda _: models.encode(body)),
        Case(
            topics.ODOM,
            topics.ODOM_NODE,
            20,
            lambda now_ns: encode_odometry(estimate._replace(stamp_ns=now_ns), 'odom', 'base_link'),
        ),
        Case(topics.WORLD_POSE, topics.WORLD_POSE_NODE, 20, lambda now_ns: encode_pose_stamped(POSE, now_ns, 'map')),
        Case(topics.GLOBAL_POSE, topics.GLOBAL_POSE_NODE, 20, lambda now_ns: encode_pose_stamped(POSE, now_ns, 'map')),
        Case(
            topics.ENCODER_PULSE,
            topics.ENCODER_NODE,
            20,
            lambda now_ns: encode_encoder_pulse(EncoderSample(now_ns, 3, 4), JOINTS),
        ),
        Case(topics.CMD_VEL, topics.NAVIGATION_TRIAL_NODE, 20, lambda _: encode_command(0.45, 0.3)),
        Case(
            topics.SCAN,
            topics.SIMULATOR_NODE,
            10,
            lambda now_ns: encode_scan(Scan(now_ns, -3.14, 0.00628, 0.15, 6.0, grid_scan), 'laser', 0.1),
        ),
        Case(
            topics.AMCL_POSE,
            topics.AMCL_NODE,
            1,
            lambda now_ns: encode_pose_with_covariance(POSE, np.eye(3), now_ns, 'map'),
        ),
    ]


def _make_us(case: Case, count: int) -> float:
    began_s = time.process_time()
    for index in range(count):
        case.make(index * PERIOD_NS)
    return (time.process_time() - began_s) / count * 1e6


def _rosbags_us(case: Case, count: int) -> float:
    kind = topics.recorded_topics('full')[case.topic].message_type
    message = noetic_store().deserialize_ros1(case.make(0), kind)
    began_s = time.process_time()
    for _ in range(count):
        noetic_store().serialize_ros1(message, kind)
    return (time.process_time() - began_s) / count * 1e6


def _record_us(case: Case, count: int) -> float:
    with tempfile.TemporaryDirectory() as folder:
        began_s = time.process_time()
        with TrialBag(Path(folder) / 'trial.bag', 'full') as bag:
            for index in range(count):
                now_ns = index * PERIOD_NS
                bag.write(case.topic, case.node, case.make(now_ns), now_ns)
        return (time.process_time() - began_s) / count * 1e6


def _empty_bag_ms(repeats: int) -> float:
    """With a message on every connection."""
    with tempfile.TemporaryDirectory() as folder:
        costs_s = []
        for _ in range(repeats):
            began_s = time.process_time()
            with TrialBag(Path(folder) / 'trial.bag', 'full') as bag:
                for case in _cases():
                    bag.write(case.topic, case.node, b'\0' * 12, 0)
            costs_s.append(time.process_time() - began_s)
    return min(costs_s) * 1000


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog='example: .venv/bin/python test/benchmark/recording.py --repeats 10',
    )
    parser.add_argument('--messages', type=COUNT, default=5000, help='in each run')
    parser.add_argument('--repeats', type=COUNT, default=5, help='runs, of which the best counts')
    return parser.parse_args()


if __name__ == '__main__':
    main()
