"""The occupancy of cells."""

import numpy as np

from diff_encoder_sim.localization.occupancy_grid import occupancy


def test_occupancy_of_cells():
    visits = np.array([[0, 10, 10, 10, 0, 0, 0]], dtype=float)
    hits = np.array([[0, 2, 3, 10, 0, 0, 0]], dtype=float)
    assert occupancy(hits, visits, 0.25).tolist() == [[-1, 0, 100, 100, -1, -1, -1]]


def test_stray_hits_behind_a_wall_are_unknown():
    hits = np.array([[0, 50, 9, 0, 9]], dtype=float)
    visits = np.array([[60, 60, 9, 0, 9]], dtype=float)
    assert occupancy(hits, visits, 0.25).tolist() == [[0, 100, -1, -1, 100]]
