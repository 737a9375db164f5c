"""Particles' maps and how to read them, for the tests of SLAM."""

import numpy as np

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.patches import PatchMaps, usable_rays
from diff_encoder_sim.localization.slam_params import SIDE
from slam_room import params, room_scan

CELL_M = 0.05


def maps_of(count):
    return PatchMaps((-4.0, -4.0), (4.0, 4.0), CELL_M, count)


def rays_of(ranges, **changes):
    scan = Scan(0, 0.0, 0.5 * np.pi, 0.1, 6.0, np.array(ranges, dtype=float))
    return usable_rays(scan, changes.pop('laser', IDENTITY), params(**changes))


def cells_of(maps, particle):
    """(height, width, 4) of one particle's grid."""
    rows, columns = maps.table.shape[1:]
    return maps.cells[maps.table[particle]].transpose(0, 2, 1, 3, 4).reshape(rows * SIDE, columns * SIDE, 4)


def room_map(particles=1, scans=6, sigma_m=0.01, seed=1):
    """Maps of the room, made from true poses near the origin."""
    rng, maps = np.random.default_rng(seed), maps_of(particles)
    for _ in range(scans):
        pose = Pose2D(*rng.uniform(-0.3, 0.3, 3).tolist())
        rays = usable_rays(room_scan(pose, rng, sigma_m), IDENTITY, params())
        maps.update(np.tile(np.array(pose), (particles, 1)), rays)
    return maps


def patch_counts(maps):
    """Patches in use, each counted once, and those if every particle had its own grid of what it has seen."""
    return len(maps.references) - 1 - int(maps.free_count[0]), int(np.count_nonzero(maps.table))
