"""Where the cells of an occupancy grid lie."""

from diff_encoder_sim.base.se2 import Pose2D


def cell_centre(grid, row, column):
    """Return the centre (x, y) [m] of a cell in the map frame."""
    centre = grid.origin.compose(Pose2D((column + 0.5) * grid.resolution_m, (row + 0.5) * grid.resolution_m, 0.0))
    return centre.x_m, centre.y_m
