"""Compile the kernels of trials in advance, so that trials and parallel workers do not wait for numba."""

from __future__ import annotations

from functools import partial

import numpy as np

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.imu import ImuParams
from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.localization.amcl import warm_up as warm_up_amcl
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.navigation.navigator import warm_up as warm_up_navigation
from diff_encoder_sim.robots.solids import Box
from diff_encoder_sim.simulation.imu import Imu
from diff_encoder_sim.simulation.lidar import Lidar, LidarParams
from diff_encoder_sim.simulation.physics import GRAVITY_MPS2
from diff_encoder_sim.simulation.world import Model, Solid, World
from diff_encoder_sim.wheels.chain import Chain
from diff_encoder_sim.wheels.encoder_params import EncoderModel
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams


def _warm_up_lidar() -> None:
    box = World('room', [Model('box', np.eye(4), [Solid('box', Box((1.0, 1.0, 1.0)), np.eye(4))])])
    Lidar(box, 0.2, LidarParams(), generator(0, 'lidar_noise')).scan(0, IDENTITY)


def _warm_up_imu() -> None:
    Imu(ImuParams(), GRAVITY_MPS2, generator(0, 'imu')).measure(np.zeros((1, 10)))


def _warm_up_wheels() -> None:
    still = Drive(np.arange(2) * 50_000_000, np.zeros((2, 2)))
    Chain(EncoderParams(encoder=EncoderModel(edge_error=0.1)), OdometryParams()).run(still).poses.sum()


# Each runs its kernels once, and shares none with the others; all take 1 s with numba's cache, else 30 s.
PARTS = warm_up_navigation, partial(warm_up_amcl, AmclParams()), _warm_up_lidar, _warm_up_imu, _warm_up_wheels
