"""Where the free cells of a map are."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, UNKNOWN, FreeCells, OccupancyGrid


def test_free_cells_are_where_the_grids_own_frame_is():
    cells = np.array([[OCCUPIED, FREE], [UNKNOWN, FREE]], np.int8)
    free_cells = FreeCells(OccupancyGrid(cells, 0.5, Pose2D(10.0, 20.0, math.pi / 2)))
    assert len(free_cells) == 2
    assert free_cells.centres(np.array([1, 0, 1])) == pytest.approx(
        np.array([[9.25, 20.75], [9.75, 20.75], [9.25, 20.75]])
    )
    assert free_cells.centres(np.empty(0, int)).shape == (0, 2)
