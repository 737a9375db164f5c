"""Straight and other drives of two wheels through encoder and odometry, without a simulator."""

import math

import numpy as np

from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder

JOINTS = ('left_wheel_joint', 'right_wheel_joint')
RADIUS_M, SEPARATION_M = 0.1, 0.4
TICK_NS = 10_000_000
STANDING_TICKS = 5  # until the last report


def m_per_pulse(ppr):
    return 2.0 * math.pi * RADIUS_M / ppr


def wheels_of(seed, ppr, encoder=None, **params):
    """Encoder, odometry, and (2,) the wheels' angles at the start, as a trial has them."""
    shared = {'ppr': ppr, 'encoder': encoder or {}}
    reporting = ReportingEncoder(EncoderParams.from_mapping({**shared, 'seed': seed, **params}, 'test'))
    measured = {key: value for key, value in params.items() if key.startswith('velocity_')}
    odometry = WheelOdometry(OdometryParams.from_mapping({**shared, 'motion_noise': 0.0, **measured}, 'test'))
    return reporting, odometry, np.random.default_rng(seed).uniform(0.0, 2.0 * math.pi, 2)


def straight_drive(length_m, seed, ppr, encoder=None, speed_mps=0.45, **params):
    """The estimate at the end, and (2,) what each wheel turned [rad]."""
    turned = np.linspace(0.0, length_m / RADIUS_M, round(length_m / speed_mps * 1e9 / TICK_NS) + 1)
    turned = np.append(turned, np.full(STANDING_TICKS, turned[-1]))
    return drive(np.column_stack([turned, turned]), seed, ppr, encoder, **params)[-1]


def drive(turned_rad, seed, ppr, encoder=None, **params):
    """The estimates of a drive with (n, 2) angles, one each tick."""
    reporting, odometry, phases_rad = wheels_of(seed, ppr, encoder, **params)
    estimates = []
    for index, angles in enumerate((phases_rad + turned_rad).tolist()):
        for sample in reporting.update(index * TICK_NS, JOINTS, angles):
            estimate = odometry.update(*sample)
            if estimate is not None:
                estimates.append(estimate)
    return estimates


def counts(turned_rad, encoder, ppr=1000, seed=1, **params):
    """(n, 2) counts of a drive that begins at the angle 0, at the rate of its samples."""
    params = {'rate': 1e9 / TICK_NS, **params}
    reporting = ReportingEncoder(
        EncoderParams.from_mapping({'ppr': ppr, 'encoder': encoder, 'seed': seed, **params}, 'test')
    )
    samples = []
    for index, angles in enumerate(np.asarray(turned_rad, float).tolist()):
        samples += reporting.update(index * TICK_NS, JOINTS, angles)
    return np.array([sample[1:3] for sample in samples])
