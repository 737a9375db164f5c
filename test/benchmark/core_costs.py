#!/usr/bin/env python3
"""What one call of the core's components costs: the encoder for each joint message, the odometry
for each report."""

from __future__ import annotations

import argparse
import math
import time
from typing import Callable, List, Sequence, Tuple

from checkout import print_header
from tabulate import tabulate

from diff_encoder_sim.encoders.wheel_encoder import DiffEncoder, EncoderParams
from diff_encoder_sim.odometry.wheel_odometry import OdometryParams, WheelOdometry

JOINTS = ('left_wheel_joint', 'right_wheel_joint')
JOINT_PERIOD_NS = 10_000_000
REPORT_PERIOD_NS = 50_000_000
WHEEL_SPEED_RADPS = 4.5  # 0.45 m/s

Arguments = List[Tuple]


def main() -> None:
    """Print the table."""
    arguments = _arguments()
    print_header(f'Cost of the core: {arguments.calls} calls, best of {arguments.repeats} runs')
    rows = []
    for ppr in (40, 4096):
        odometry = OdometryParams(ppr=ppr)
        window = OdometryParams(ppr=ppr, velocity_window=10, counter_modulus=65536)
        for name, rate_hz, make, calls in (
            (
                'DiffEncoder.update',
                100,
                lambda: DiffEncoder(EncoderParams(ppr=ppr)).update,
                _joint_messages(arguments.calls),
            ),
            ('WheelOdometry.update', 20, lambda: WheelOdometry(odometry).update, _reports(arguments.calls, ppr, 0)),
            ('  window 10, int16', 20, lambda: WheelOdometry(window).update, _reports(arguments.calls, ppr, 65536)),
        ):
            cost_us = min(_cost_us(make(), calls) for _ in range(arguments.repeats))
            rows.append([ppr, name, f'{cost_us:.1f}', rate_hz, f'{cost_us * rate_hz / 1000:.2f}'])
    print(
        tabulate(
            rows,
            ['PPR', 'call', 'us per call', 'calls per\nsimulated s', 'ms per\nsimulated s'],
            disable_numparse=True,
            colalign=('right', 'left', 'right', 'right', 'right'),
        )
    )
    print('\nProcessor time. One encoder call in five is a report, as at 100 joint messages a second.')


def _cost_us(update: Callable, calls: Sequence[Tuple]) -> float:
    began_s = time.thread_time()
    for arguments in calls:
        update(*arguments)
    return (time.thread_time() - began_s) / len(calls) * 1e6


def _joint_messages(count: int) -> Arguments:
    turn_rad = WHEEL_SPEED_RADPS * JOINT_PERIOD_NS * 1e-9
    return [(index * JOINT_PERIOD_NS, JOINTS, (index * turn_rad, 0.9 * index * turn_rad)) for index in range(count)]


def _reports(count: int, ppr: int, modulus: int) -> Arguments:
    pulses = WHEEL_SPEED_RADPS * REPORT_PERIOD_NS * 1e-9 * ppr / (2.0 * math.pi)
    totals = [(math.floor(index * pulses), math.floor(0.9 * index * pulses)) for index in range(count)]
    return [
        (index * REPORT_PERIOD_NS, *(total % modulus if modulus else total for total in both))
        for index, both in enumerate(totals)
    ]


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog='example: .venv/bin/python test/benchmark/core_costs.py --repeats 10',
    )
    parser.add_argument('--calls', type=int, default=20000, help='in each run')
    parser.add_argument('--repeats', type=int, default=5, help='runs, of which the best counts')
    return parser.parse_args()


if __name__ == '__main__':
    main()
