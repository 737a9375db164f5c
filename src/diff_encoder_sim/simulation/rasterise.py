"""A map straight from a world file: the one that a perfect mapper with a scanner would make."""

from __future__ import annotations

from typing import Tuple

import numpy as np

from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.map_image import LARGEST_IMAGE
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from diff_encoder_sim.robots.robot_tree import Box, Cylinder, Sphere
from diff_encoder_sim.simulation.lidar import cut_world
from diff_encoder_sim.simulation.world import Solid, World

ndimage = deferred('scipy.ndimage')

MARGIN_CELLS = 10
POINTS_PER_CELL = 8
MOST_POINTS = 10_000_000  # of surfaces; some hundred megabytes


def rasterise(world: World, height_m: float, resolution_m: float, free_x_m: float, free_y_m: float) -> OccupancyGrid:
    """Map a world: its surfaces at `height_m` are occupied, cells connected to a free point free.

    All behind the surfaces stays unknown. Cells are centred on multiples of the resolution: walls
    are built on such lines, and would otherwise all be drawn half a cell to one side, an error
    that localization on the map would inherit.

    Args:
        world: the map frame is its frame.
        height_m: of the scan plane.
        resolution_m: side of a cell.
        free_x_m: a point that is free, in the world frame.
        free_y_m: likewise.

    Raises:
        ConfigError: the free point is inside a wall, nothing is at that height, or the cells or the points of
            surfaces would be too many.
    """
    points_m = surface_points(world, height_m, resolution_m / POINTS_PER_CELL)
    if len(points_m) == 0:
        raise ConfigError(f'world {world.name!r}: nothing to map at a height of {height_m} m')
    grid = _grid_around(points_m, resolution_m)
    if any(_is_inside(solid, free_x_m, free_y_m, height_m) for solid in world.solids):
        raise ConfigError(f'free point ({free_x_m}, {free_y_m}): in a wall; allowed: a point in free space')
    seed = grid.cell_at(free_x_m, free_y_m)
    if not grid.contains(*seed) or grid.cells[seed] != UNKNOWN:
        raise ConfigError(
            f'free point ({free_x_m}, {free_y_m}): outside of the map or on a surface; allowed: a point in free space'
        )
    _fill(grid, seed)
    return grid


def _grid_around(points_m: np.ndarray, resolution_m: float) -> OccupancyGrid:
    """Return a grid around points (n, 2), unknown but for the cells that hold one."""
    lowest = np.floor(points_m.min(axis=0) / resolution_m) - MARGIN_CELLS
    highest = np.ceil(points_m.max(axis=0) / resolution_m) + MARGIN_CELLS
    count = (highest - lowest).prod()
    if count > LARGEST_IMAGE:  # nobody could read its file
        raise ConfigError(
            f'resolution {resolution_m:g} m: a map of {count:.0f} cells; allowed: at most {LARGEST_IMAGE}'
        )
    width, height = (highest - lowest).astype(int).tolist()
    corner_m = np.round((lowest - 0.5) * resolution_m, 9)
    cells = np.full((height, width), UNKNOWN, dtype=np.int8)
    columns_rows = np.floor((points_m - corner_m) / resolution_m + 1e-9).astype(int)
    cells[columns_rows[:, 1], columns_rows[:, 0]] = OCCUPIED
    return OccupancyGrid(cells, resolution_m, Pose2D(float(corner_m[0]), float(corner_m[1]), 0.0))


def surface_points(world: World, height_m: float, spacing_m: float) -> np.ndarray:
    """Return (n, 2) points [m], at most `spacing_m` apart, on all surfaces at a height.

    Raises:
        ConfigError: they would be too many.
    """
    segments, circles = cut_world(world, height_m)
    length_m = np.hypot(*(segments[:, 2:] - segments[:, :2]).T).sum() + 2.0 * np.pi * circles[:, 2].sum()
    if length_m > MOST_POINTS * spacing_m:
        raise ConfigError(
            f'world {world.name!r}: {length_m:.0f} m of surfaces, with a point each {spacing_m:g} m; '
            f'allowed: at most {MOST_POINTS} points'
        )
    lines = []
    for x0, y0, x1, y1 in segments:
        count = int(np.ceil(np.hypot(x1 - x0, y1 - y0) / spacing_m)) + 1
        lines.append(np.column_stack([np.linspace(x0, x1, count), np.linspace(y0, y1, count)]))
    for x, y, radius_m in circles:
        count = int(np.ceil(2.0 * np.pi * radius_m / spacing_m)) + 1
        angles_rad = np.linspace(0.0, 2.0 * np.pi, count)
        lines.append(np.column_stack([x + radius_m * np.cos(angles_rad), y + radius_m * np.sin(angles_rad)]))
    return np.concatenate(lines) if lines else np.empty((0, 2))


def _is_inside(solid: Solid, x_m: float, y_m: float, z_m: float) -> bool:
    local = np.linalg.inv(solid.pose_in_world) @ (x_m, y_m, z_m, 1.0)
    shape = solid.shape
    if isinstance(shape, Box):
        return bool((np.abs(local[:3]) <= 0.5 * np.array(shape.size_xyz_m)).all())
    if isinstance(shape, Cylinder):
        return bool(np.hypot(*local[:2]) <= shape.radius_m and abs(local[2]) <= shape.length_m / 2)
    return isinstance(shape, Sphere) and bool(np.linalg.norm(local[:3]) <= shape.radius_m)


def _fill(grid: OccupancyGrid, seed: Tuple[int, int]) -> None:
    """Mark cells connected to the seed as free, and surfaces that border none of them as unknown."""
    regions, _ = ndimage.label(grid.cells == UNKNOWN)
    is_free = regions == regions[seed]
    if is_free[[0, -1]].any() or is_free[:, [0, -1]].any():
        raise ConfigError('free space reaches the edge of the map; expected a world with a closed outer wall')
    is_surface = (grid.cells == OCCUPIED) & ndimage.binary_dilation(is_free)
    grid.cells[...] = UNKNOWN
    grid.cells[is_free], grid.cells[is_surface] = FREE, OCCUPIED
