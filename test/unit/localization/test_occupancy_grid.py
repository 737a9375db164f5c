"""Cells, points and crops of occupancy grids."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from grid_cells import cell_centre


def test_cells_and_points_agree_on_a_turned_map():
    grid = OccupancyGrid(np.zeros((4, 6), dtype=np.int8), 0.5, Pose2D(1.0, 2.0, math.pi / 2))
    assert cell_centre(grid, 0, 0) == pytest.approx((0.75, 2.25))
    for row in range(4):
        for column in range(6):
            assert grid.cell_at(*cell_centre(grid, row, column)) == (row, column)


@pytest.mark.parametrize(
    ('row', 'column', 'is_on'), [(0, 0, True), (3, 5, True), (-1, 0, False), (4, 0, False), (0, 6, False)]
)
def test_a_grid_contains_its_rows_and_columns(row, column, is_on):
    grid = OccupancyGrid(np.zeros((4, 6), dtype=np.int8), 0.5, IDENTITY)
    assert grid.contains(row, column) is is_on


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


def test_a_grid_without_known_cells_is_not_cropped():
    grid = OccupancyGrid(np.full((3, 4), UNKNOWN, dtype=np.int8), 0.5, IDENTITY)
    assert grid.cropped(0.0) is grid
