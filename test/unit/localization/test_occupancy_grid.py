"""Cells, points and crops of occupancy grids, and where their free cells are."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, UNKNOWN, FreeCells, OccupancyGrid, occupancy
from grid_cells import cell_centre


def test_cells_and_points_agree_on_a_turned_map():
    grid = OccupancyGrid(np.zeros((4, 6), dtype=np.int8), 0.5, Pose2D(1.0, 2.0, math.pi / 2))
    assert cell_centre(grid, 0, 0) == pytest.approx((0.75, 2.25))
    for row in range(4):
        for column in range(6):
            assert grid.cell_at(*cell_centre(grid, row, column)) == (row, column)

    inside = [(row, column) for row in range(-2, 7) for column in range(-2, 9) if grid.contains(row, column)]
    assert inside == [(row, column) for row in range(4) for column in range(6)]


def test_a_crop_keeps_what_is_known_where_it_was():
    cells = np.full((20, 30), UNKNOWN, dtype=np.int8)
    cells[4, 2], cells[10, 25] = OCCUPIED, FREE
    grid = OccupancyGrid(cells, 0.5, Pose2D(1.0, 2.0, 0.3))
    crop = grid.cropped(1.6)  # three cells, on the left only two
    assert (crop.height, crop.width) == (13, 29)
    for row, column in ((4, 2), (10, 25)):
        at = crop.cell_at(*cell_centre(grid, row, column))
        assert crop.cells[at] == cells[row, column]
    assert np.sum(crop.cells != UNKNOWN) == 2


@pytest.mark.parametrize(
    ('hits', 'visits', 'expected'),
    [
        ([0, 2, 3, 10, 0, 0, 0], [0, 10, 10, 10, 0, 0, 0], [-1, 0, 100, 100, -1, -1, -1]),
        ([0, 50, 9, 0, 9], [60, 60, 9, 0, 9], [0, 100, -1, -1, 100]),  # stray hits behind a wall are unknown
    ],
)
def test_occupancy_of_cells(hits, visits, expected):
    assert occupancy(np.array([hits], float), np.array([visits], float), 0.25).tolist() == [expected]


def test_free_cells_are_where_the_grids_own_frame_is():
    cells = np.array([[OCCUPIED, FREE], [UNKNOWN, FREE]], np.int8)
    free_cells = FreeCells(OccupancyGrid(cells, 0.5, Pose2D(10.0, 20.0, math.pi / 2)))
    assert len(free_cells) == 2
    centres_m = np.array([[9.25, 20.75], [9.75, 20.75], [9.25, 20.75]])
    assert free_cells.centres(np.array([1, 0, 1])) == pytest.approx(centres_m)
    assert free_cells.centres(np.empty(0, int)).shape == (0, 2)
