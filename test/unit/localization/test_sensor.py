"""What all laser models share: particles in the grid's frame, in cells."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.laser_models import laser_model
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid


def test_particles_are_placed_in_the_cells_that_hold_them_whatever_the_origin():
    """With fractions: 2.5 is the middle of cell 2, as nav_msgs/OccupancyGrid defines it."""
    grid = OccupancyGrid(np.zeros((20, 30), np.int8), 0.1, Pose2D(1.0, -2.0, 0.7))
    local = Pose2D(1.25, 0.55, 0.4)
    particle = np.array([grid.origin.compose(local)])
    column, row, cosine, sine = laser_model(AmclParams(), grid)._poses_in_cells(particle)[0]
    assert (column, row) == pytest.approx((12.5, 5.5))
    assert math.atan2(sine, cosine) == pytest.approx(0.4)
    assert grid.cell_at(*particle[0, :2]) == (5, 12)
