#!/usr/bin/env python3
"""What one call of the core's components costs: the encoder for each joint message, the odometry
for each report; and what an encoder with all of its errors costs beside the ideal one."""

from __future__ import annotations

import argparse
import math
import time
from typing import Callable, Dict, List, Sequence, Tuple

from checkout import print_header
from counts import COUNT
from tabulate import tabulate

from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder

JOINTS = ('left_wheel_joint', 'right_wheel_joint')
JOINT_PERIOD_NS = 10_000_000
REPORT_PERIOD_NS = 50_000_000
WHEEL_SPEED_RADPS = 4.5  # 0.45 m/s

# What an encoder can have at a time: on the motor, with play, all errors of the sensor, faults, and a poor line.
FULL = {
    'lines': 12,
    'gear_ratio': 34.0,
    'side': 'motor',
    'backlash': 0.01,
    'duty_cycle': 0.45,
    'phase_error': 10.0,
    'edge_error': 0.05,
    'eccentricity': 0.02,
    'hysteresis': 0.1,
    'faults': {'missed': 1e-3, 'extra': 1e-3, 'max_count_rate': 1e5, 'dead_channel': 'B', 'dead_from': 50.0},
}
REPORT = {'jitter': 0.002, 'latency': 0.01, 'latency_spread': 0.005, 'lost': 0.01, 'repeated': 0.01, 'reordered': 0.01}
CHAINS: Dict[str, Dict] = {
    'ideal': {},
    'full': {'encoder': FULL, 'report': REPORT},
    'full, speed by M/T': {'encoder': FULL, 'report': REPORT, 'velocity_method': 'MT'},
}

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
                'ReportingEncoder.update',
                100,
                lambda: ReportingEncoder(EncoderParams(ppr=ppr)).update,
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
    _print_ratio(arguments)


def _print_ratio(arguments: argparse.Namespace) -> None:
    """Print encoder and odometry together for a joint message, with an ideal encoder and a full chain in turn."""
    calls = _joint_messages(arguments.calls)
    costs_us = {name: [] for name in CHAINS}
    for _ in range(arguments.repeats):
        for name, params in CHAINS.items():
            costs_us[name].append(_cost_us(_encoder_and_odometry(params), calls))
    ideal_us = min(costs_us['ideal'])
    rows = [[name, f'{min(each):.1f}', f'{min(each) / ideal_us:.2f}'] for name, each in costs_us.items()]
    print('\nEncoder and odometry, for each joint message at 100 Hz, reports at 20 Hz:\n')
    print(
        tabulate(rows, ['encoder', 'us', 'times the ideal'], disable_numparse=True, colalign=('left', 'right', 'right'))
    )


def _encoder_and_odometry(params: Dict) -> Callable:
    encoder = ReportingEncoder(EncoderParams.from_mapping(params, 'benchmark'))
    of_odometry = {key: value for key, value in params.items() if key in OdometryParams.model_fields}
    odometry = WheelOdometry(OdometryParams.from_mapping(of_odometry, 'benchmark'))

    def update(*joints) -> None:
        for sample in encoder.update(*joints):
            odometry.update(*sample)

    return update


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
    parser.add_argument('--calls', type=COUNT, default=20000, help='in each run')
    parser.add_argument('--repeats', type=COUNT, default=5, help='runs, of which the best counts')
    return parser.parse_args()


if __name__ == '__main__':
    main()
