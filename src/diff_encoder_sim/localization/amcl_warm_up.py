"""Compile ahead: a live filter must not spend its first scans on numba's compiler."""

from __future__ import annotations

import math

import numpy as np

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.amcl import Amcl
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.laser_models import laser_model
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from diff_encoder_sim.localization.scan_fit import FitMap

CELLS, RESOLUTION_M, RAYS, PARTICLES = 60, 0.1, 20, 20


def warm_up(params: AmclParams) -> None:
    """Run each kernel that a filter with these parameters, and the check of its scans, need once, in a small room.

    Takes milliseconds where numba's cache is filled, some seconds where it is not.
    """
    counts = {'min_particles': PARTICLES, 'max_particles': PARTICLES}
    few = params.model_copy(update={**counts, 'resample_interval': 1, 'selective_resampling': False})
    grid = _room()
    scan = Scan(0, -math.pi, 2.0 * math.pi / RAYS, 0.1, 10.0, np.full(RAYS, 2.9))
    amcl = Amcl(few, grid, np.random.default_rng(0))
    amcl.update(IDENTITY, scan, IDENTITY)
    FitMap(grid, RESOLUTION_M).fit(IDENTITY, scan, IDENTITY)
    # Beam skipping waits for particles that have converged.
    model = laser_model(few, grid)
    model.likelihoods(amcl.particles, model.beams(scan, IDENTITY), True)


def _room() -> OccupancyGrid:
    """Return an empty room of 6 x 6 m about the map's origin."""
    cells = np.full((CELLS, CELLS), OCCUPIED, np.int8)
    cells[1:-1, 1:-1] = FREE
    corner_m = -0.5 * CELLS * RESOLUTION_M
    return OccupancyGrid(cells, RESOLUTION_M, Pose2D(corner_m, corner_m, 0.0))
