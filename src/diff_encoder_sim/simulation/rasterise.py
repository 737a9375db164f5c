"""A map made directly from a world file, as a perfect mapper with a scanner would make it."""

from __future__ import annotations

import numpy as np

from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.map_files import LARGEST_IMAGE
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from diff_encoder_sim.robots.solids import Shape
from diff_encoder_sim.simulation.lidar import cut_world
from diff_encoder_sim.simulation.world import Plane, World

ndimage = deferred('scipy.ndimage')

MARGIN_CELLS = 10
POINTS_PER_CELL = 8
MOST_POINTS = 10_000_000  # of surfaces; some hundred megabytes


def rasterise(world: World, height_m: float, resolution_m: float, free_x_m: float, free_y_m: float) -> OccupancyGrid:
    """Map a world: surfaces at a height are occupied, cells connected to a free point free, all others unknown.

    Cells are centred on multiples of the resolution: walls are built on such lines, and would otherwise all be drawn
    half a cell to one side, an error that localization on the map would inherit. The map frame is that of the world,
    `resolution_m` the side of a cell.

    ConfigError if the free point is inside a wall, nothing is at that height, or the cells or the points of surfaces
    would be too many.
    """
    points_m = surface_points(world, height_m, resolution_m / POINTS_PER_CELL)
    if len(points_m) == 0:
        raise ConfigError(f'world {world.name!r}: nothing to map at a height of {height_m} m')
    lowest = np.floor(points_m.min(axis=0) / resolution_m) - MARGIN_CELLS
    highest = np.ceil(points_m.max(axis=0) / resolution_m) + MARGIN_CELLS
    count = (highest - lowest).prod()
    if count > LARGEST_IMAGE:
        allowed = f'at most {LARGEST_IMAGE}'
        raise ConfigError(f'resolution {resolution_m:g} m: a map of {count:.0f} cells; allowed: {allowed}')
    width, height = (highest - lowest).astype(int).tolist()
    corner_m = np.round((lowest - 0.5) * resolution_m, 9)
    columns, rows = np.floor((points_m - corner_m) / resolution_m + 1e-9).astype(int).T
    is_surface = np.zeros((height, width), bool)
    is_surface[rows, columns] = True
    cells = np.full((height, width), UNKNOWN, dtype=np.int8)
    grid = OccupancyGrid(cells, resolution_m, Pose2D(float(corner_m[0]), float(corner_m[1]), 0.0))
    seed, point = grid.cell_at(free_x_m, free_y_m), f'free point ({free_x_m}, {free_y_m})'
    shapes = [Shape(each.shape, each.pose_in_world) for each in world.solids if not isinstance(each.shape, Plane)]
    if any(shape.holds(np.array([free_x_m, free_y_m, height_m])) for shape in shapes):
        raise ConfigError(f'{point}: in a wall; allowed: a point in free space')
    if not grid.contains(*seed) or is_surface[seed]:
        raise ConfigError(f'{point}: outside of the map or on a surface; allowed: a point in free space')
    regions, _ = ndimage.label(~is_surface)
    is_free = regions == regions[seed]
    if is_free[[0, -1]].any() or is_free[:, [0, -1]].any():
        raise ConfigError('free space reaches the edge of the map; expected a world with a closed outer wall')
    # Surfaces inside walls stay unknown.
    cells[is_surface & ndimage.binary_dilation(is_free)] = OCCUPIED
    cells[is_free] = FREE
    return grid


def surface_points(world: World, height_m: float, spacing_m: float) -> np.ndarray:
    """Return (n, 2) points [m], at most `spacing_m` apart, on all surfaces at a height; ConfigError if too many."""
    segments, circles = cut_world(world, height_m)
    lengths_m = np.hypot(*(segments[:, 2:] - segments[:, :2]).T)
    length_m = lengths_m.sum() + 2.0 * np.pi * circles[:, 2].sum()
    if length_m > MOST_POINTS * spacing_m:
        given = f'{length_m:.0f} m of surfaces, with a point each {spacing_m:g} m'
        raise ConfigError(f'world {world.name!r}: {given}; allowed: at most {MOST_POINTS} points')
    lines = [
        np.linspace(segment[:2], segment[2:], int(np.ceil(segment_m / spacing_m)) + 1)
        for segment, segment_m in zip(segments, lengths_m)
    ]
    for x, y, radius_m in circles:
        angles_rad = np.linspace(0.0, 2.0 * np.pi, int(np.ceil(2.0 * np.pi * radius_m / spacing_m)) + 1)
        lines.append(np.column_stack([x + radius_m * np.cos(angles_rad), y + radius_m * np.sin(angles_rad)]))
    return np.concatenate(lines) if lines else np.empty((0, 2))
