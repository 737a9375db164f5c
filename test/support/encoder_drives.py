"""Drives of two wheels through encoder and odometry, without a simulator."""

import math

import numpy as np

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.wheels.chain import Chain
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

RADIUS_M, SEPARATION_M = 0.1, 0.4
TICK_NS = 10_000_000
STANDING_TICKS = 5  # until the last report


def m_per_pulse(ppr):
    return 2.0 * math.pi * RADIUS_M / ppr


def straight_drive(length_m, seed, ppr, encoder=None, speed_mps=0.45, **params):
    """The estimate at the end of a straight drive."""
    turned = np.linspace(0.0, length_m / RADIUS_M, round(length_m / speed_mps * 1e9 / TICK_NS) + 1)
    turned = np.append(turned, np.full(STANDING_TICKS, turned[-1]))
    return drive(np.column_stack([turned, turned]), seed, ppr, encoder, **params)[-1]


def drive(turned_rad, seed, ppr, encoder=None, **params):
    """The estimates of a drive with (n, 2) angles, one each tick, from phases by the seed."""
    shared = {'ppr': ppr, 'encoder': encoder or {}}
    measured = {key: value for key, value in params.items() if key.startswith('velocity_')}
    chain = Chain(
        EncoderParams.from_mapping({**shared, 'seed': seed, **params}, 'test'),
        OdometryParams.from_mapping({**shared, 'motion_noise': 0.0, **measured}, 'test'),
    )
    phases_rad = np.random.default_rng(seed).uniform(0.0, 2.0 * math.pi, 2)
    run = chain.run(Drive(TICK_NS * np.arange(len(turned_rad)), phases_rad + turned_rad))
    return [estimate for estimate in run.estimates() if estimate is not None]
