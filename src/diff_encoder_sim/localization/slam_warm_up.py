"""Compile ahead: a live mapper must not spend its first scans on numba's compiler."""

from __future__ import annotations

import math

import numpy as np

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.localization.grid_slam import GridSlam
from diff_encoder_sim.localization.slam_params import GridSlamParams

RAYS, PARTICLES = 60, 2


def warm_up(params: GridSlamParams) -> None:
    """Map a small room: takes tenths of a second where numba's cache is filled, else seconds."""
    few = params.model_copy(update={'particles': PARTICLES, 'linearUpdate': 0.0})
    slam = GridSlam(few, np.random.default_rng(0))
    scan = Scan(0, -math.pi, 2.0 * math.pi / RAYS, 0.1, 10.0, np.full(RAYS, 2.0))
    for stamp_ns in range(2):
        slam.update(IDENTITY, scan._replace(stamp_ns=stamp_ns), IDENTITY)
