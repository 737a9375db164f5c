"""The map of a test's world behind its trajectories."""

from __future__ import annotations

from typing import Optional

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.transforms import Affine2D

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.drives.test_definition import find_world
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.localization.map_files import load_map
from diff_encoder_sim.localization.occupancy_grid import OCCUPIED, UNKNOWN, OccupancyGrid

FREE_GREY, UNKNOWN_GREY, OCCUPIED_GREY = '1.0', '0.94', '0.6'


def map_of(requested: Trial) -> Optional[OccupancyGrid]:
    """Load the map beside the test's world; None where this host has no such world, or no map."""
    try:
        world = find_world(requested.test.world, package_folder() / 'worlds')
        return load_map(world.with_suffix('.yaml'))
    except ConfigError:
        return None


def draw_map(panel: Axes, grid: OccupancyGrid) -> None:
    """Draw the grid in the map frame."""
    shades = np.ones(grid.cells.shape)
    shades[grid.cells == UNKNOWN], shades[grid.cells == OCCUPIED] = 0.0, 2.0
    width_m, height_m = grid.width * grid.resolution_m, grid.height * grid.resolution_m
    placed = Affine2D().rotate(grid.origin.yaw_rad).translate(grid.origin.x_m, grid.origin.y_m)
    panel.imshow(
        shades,
        cmap=ListedColormap([UNKNOWN_GREY, FREE_GREY, OCCUPIED_GREY]),
        vmin=0.0,
        vmax=2.0,
        origin='lower',
        interpolation='nearest',
        extent=(0.0, width_m, 0.0, height_m),
        transform=placed + panel.transData,
    )
