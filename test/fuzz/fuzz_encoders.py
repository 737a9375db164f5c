"""Encoders: odd parameters of every stage, and odd motions, through encoder and odometry."""

import logging

import numpy as np

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.params import split_params
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder
from odd_values import odd_float, odd_mapping, pick, write_yaml

GOOD = {
    'rate': 20.0,
    'counter_modulus': 65536,
    'velocity_method': 'MT',
    'velocity_low_pass': 0.1,
    'encoder': {
        'sensor': 'quadrature', 'lines': 12, 'decoding': 'x4', 'side': 'motor', 'gear_ratio': 34.014, 'backlash': 0.01,
        'duty_cycle': 0.45, 'phase_error': 10.0, 'edge_error': 0.1, 'eccentricity': 0.02, 'hysteresis': 0.2,
        'direction': 'phases',
        'faults': {
            'missed': 0.01, 'missed_burst': 3.0, 'extra': 0.01, 'max_count_rate': 1e4, 'dead_channel': 'B',
            'dead_from': 1.0, 'dead_for': 0.5, 'dead_every': 2.0, 'restart_at': 3.0, 'wiring': 'straight',
            'wheel': 'left',
        },
    },
    'report': {
        'jitter': 0.01, 'latency': 0.02, 'latency_spread': 0.03, 'stamps': 'arrival', 'lost': 0.1, 'repeated': 0.1,
        'reordered': 0.1,
    },
}  # fmt: skip
SENSORS = (
    {'lines': 12},
    {'sensor': 'hall', 'pole_pairs': 15, 'sensor_error': 5.0},
    {'sensor': 'single_channel', 'lines': 20, 'decoding': 'x1'},
    {'sensor': 'absolute', 'bits': 12, 'first_harmonic': 0.5, 'noise': 1.0},
)
JOINTS = ('left_wheel_joint', 'right_wheel_joint')
SAMPLES, TICK_NS = 400, 10_000_000


def warm_up(folder):
    logging.disable()  # odometry warns of most motions here
    _drive(np.random.default_rng(0), write_yaml(np.random.default_rng(0), folder / 'config.yaml', GOOD))


def run(rng, folder):
    good = GOOD if rng.random() < 0.5 else {**GOOD, 'encoder': dict(pick(rng, SENSORS))}
    path = write_yaml(rng, folder / 'config.yaml', odd_mapping(rng, good, 1))
    _drive(rng, path)


def _drive(rng, path):
    encoder, odometry = split_params(load_yaml(path), str(path), EncoderParams, OdometryParams)
    motion = list(_motion(rng))
    assert _counts(encoder, odometry, motion) == _counts(encoder, odometry, motion), 'equal seeds give unequal counts'
    model = encoder.encoder
    is_sound = model.faults == type(model.faults)() and encoder.report == type(encoder.report)()
    if is_sound and not (model.noise or model.counts_by_command or encoder.counter_modulus):
        angles = np.cumsum(np.random.default_rng(1).uniform(0.0, 0.2, SAMPLES)).tolist()
        forward = [(index * TICK_NS, [angle, angle]) for index, angle in enumerate(angles)]
        counts = np.array([sample[1:3] for sample in _counts(encoder, odometry, forward)])
        assert len(counts) < 2 or (np.diff(counts, axis=0) >= 0).all(), 'counts fall while the wheels turn forward'


def _motion(rng):
    """Yield stamps and the wheels' angles: a random walk, with jumps, standstill and odd numbers now and then."""
    angles, stamp_ns = np.zeros(2), 0
    for _ in range(SAMPLES):
        stamp_ns += TICK_NS * int(pick(rng, (1, 1, 1, 1, 0, 7, -2, 300)) if rng.random() < 0.1 else 1)
        angles = angles + rng.normal(0.0, pick(rng, (0.0, 0.01, 0.3)), 2)
        yield max(stamp_ns, 0), [odd_float(rng, angle) if rng.random() < 0.02 else angle for angle in angles.tolist()]


def _counts(encoder_params, odometry_params, motion):
    encoder, odometry = ReportingEncoder(encoder_params), WheelOdometry(odometry_params)
    samples = []
    for stamp_ns, angles in motion:
        try:
            samples += encoder.update(stamp_ns, JOINTS, angles)
        except InputFault:
            continue
        encoder.take_command(angles[0], angles[1])
    for estimate in filter(None, [odometry.update(*sample) for sample in samples]):
        numbers = (*estimate.base_pose_in_odom, estimate.linear_velocity_mps, estimate.angular_velocity_radps)
        assert np.isfinite((*numbers, *estimate.of_pose)).all(), f'odometry {numbers}, {estimate.of_pose}'
    return samples
