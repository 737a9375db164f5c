"""Compiling ahead."""

import numpy as np

from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.localization.grid_slam import GridSlam, warm_up
from slam_room import params, room_scan


def test_warming_up_leaves_no_trace():
    given = params()
    maps = []
    for _ in range(2):
        slam = GridSlam(given, np.random.default_rng(0))
        slam.update(IDENTITY, room_scan(IDENTITY), IDENTITY)
        maps.append(slam.map())
        warm_up(given)
    assert given == params()
    assert (maps[0].cells == maps[1].cells).all()
