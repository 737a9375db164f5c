"""A map straight from a world file: the one that a perfect mapper with a scanner would make."""

from __future__ import annotations

import itertools
import math
from typing import List, NamedTuple, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.map_files import LARGEST_IMAGE
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from diff_encoder_sim.robots.description import Box, Cylinder, Sphere
from diff_encoder_sim.simulation.lidar import cast_rays, cut_world
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


SPACING_M = 0.01  # between the points by which a surface is represented

# Cells of the raster that finds which surfaces can be seen at all from where the robot is [m].
RASTER_M = 0.05

# Distances are compared in cells; this much of one is rounding.
ROUNDING_CELLS = 1e-6


class MapAccuracy(NamedTuple):
    """A map compared with the true surfaces; distances are between centres of cells."""

    occupied_cells: int
    correct_fraction: float  # of occupied cells: a cell that a true surface crosses or touches is near
    close_fraction: float  # of occupied cells, more strictly: the centre is near a true surface
    mapped_fraction: float  # of the visible surface's length: an occupied cell is near


def map_accuracy(
    grid: OccupancyGrid, map_pose_in_world: Pose2D, surface_m: np.ndarray, visible_m: np.ndarray, near_m: float
) -> MapAccuracy:
    """Compare a map with the truth.

    Args:
        grid: 100 is occupied.
        map_pose_in_world: where the map's frame is.
        surface_m: (n, 2) points of the world on every surface, from `true_surface`.
        visible_m: (m, 2) those that could have been seen, from `visible_points`.
        near_m: what near means; one cell is the least that makes sense.

    Raises:
        ConfigError: no surface, or none visible: nothing to compare with.
    """
    if len(surface_m) == 0 or len(visible_m) == 0:
        found = f'{len(surface_m)} points of surface, {len(visible_m)} of it visible'
        raise ConfigError(f'{found}: no map can be compared with that')
    rows, columns = np.nonzero(grid.cells == OCCUPIED)
    occupied = np.column_stack([columns, rows]) + 0.5
    if len(occupied) == 0:
        return MapAccuracy(0, math.nan, math.nan, 0.0)
    grid_pose = map_pose_in_world.compose(grid.origin)
    surface, visible = (_in_cells(points, grid_pose, grid.resolution_m) for points in (surface_m, visible_m))
    near_cells = near_m / grid.resolution_m
    crossed = np.unique(np.concatenate(_touched_cells(surface)), axis=0)
    is_mapped = [_is_near(cells, occupied, near_cells) for cells in _touched_cells(visible)]
    return MapAccuracy(
        len(occupied),
        float(_is_near(occupied, crossed, near_cells).mean()),
        float(_is_near(occupied, surface, near_cells).mean()),
        float(np.any(is_mapped, axis=0).mean()),
    )


def true_surface(world: World, height_m: float, free_x_m: float, free_y_m: float) -> np.ndarray:
    """Return (n, 2) points of the surfaces around a free point [m], in the world frame.

    Surfaces inside walls are left out, unless they lie within a raster cell of the wall's face.

    Raises:
        ConfigError: as `rasterise`.
    """
    points_m = surface_points(world, height_m, SPACING_M)
    raster = rasterise(world, height_m, RASTER_M, free_x_m, free_y_m)
    columns, rows = np.floor(_in_cells(points_m, raster.origin, RASTER_M) + 1e-9).astype(int).T
    return np.asarray(points_m[raster.cells[rows, columns] == OCCUPIED])


def visible_points(
    world: World,
    height_m: float,
    surface_m: np.ndarray,
    laser_poses_in_world: Sequence[Pose2D],
    bearings_rad: np.ndarray,
    range_m: float,
) -> np.ndarray:
    """Return (m, 2) points of a surface that a scanner without noise would have hit on a drive.

    Args:
        world: what is scanned.
        height_m: of the scan plane.
        surface_m: (n, 2) from `true_surface`.
        laser_poses_in_world: of each scan.
        bearings_rad: (k,) of the rays, equally spaced.
        range_m: of the scanner.
    """
    segments, circles = cut_world(world, height_m)
    ends = []
    for pose in laser_poses_in_world:
        directions_rad = pose.yaw_rad + bearings_rad
        ranges_m = cast_rays(pose.x_m, pose.y_m, directions_rad, segments, circles)
        is_hit = ranges_m < range_m
        unit_vectors = np.column_stack([np.cos(directions_rad[is_hit]), np.sin(directions_rad[is_hit])])
        ends.append(np.array(pose[:2]) + ranges_m[is_hit, np.newaxis] * unit_vectors)
    # Thinned to a raster finer than the points lie: nothing is lost, and the search is short.
    ends_m = np.unique(np.round(np.concatenate(ends) / (0.5 * SPACING_M)), axis=0) * (0.5 * SPACING_M)
    return np.asarray(surface_m[_is_near(surface_m / SPACING_M, ends_m / SPACING_M, 1.0)])


def _in_cells(points_m: np.ndarray, origin: Pose2D, cell_m: float) -> np.ndarray:
    """Convert (n, 2) points of the frame that `origin` is given in to column and row, not rounded."""
    cos_yaw, sin_yaw = math.cos(origin.yaw_rad), math.sin(origin.yaw_rad)
    x_m, y_m = points_m[:, 0] - origin.x_m, points_m[:, 1] - origin.y_m
    return np.column_stack([cos_yaw * x_m + sin_yaw * y_m, cos_yaw * y_m - sin_yaw * x_m]) / cell_m


def _touched_cells(points: np.ndarray) -> List[np.ndarray]:
    """Return the centres of the cells that points (n, 2) are in, (n, 2) each; on a border these differ.

    So it does not matter on which side of a border rounding puts a point, which the grid's corner decides.
    """
    sides = itertools.product((-ROUNDING_CELLS, ROUNDING_CELLS), repeat=2)
    return [np.floor(points + np.array(side)) + 0.5 for side in sides]


def _is_near(points: np.ndarray, others: np.ndarray, distance: float) -> np.ndarray:
    """Find which points (n, 2) have some of the others (m, 2) within a distance: (n,) bool.

    Only others in the same or a neighbouring square of a coarse raster are compared.
    """
    limit = distance * (1.0 + ROUNDING_CELLS) + ROUNDING_CELLS
    order, starts, squares, width = _sorted_into_squares(others, limit)
    columns, rows = np.floor((points - (others.min(axis=0) - limit)) / limit).astype(int).T
    found = np.zeros(len(points), bool)
    for row_offset, column_offset in itertools.product((-1, 0, 1), repeat=2):
        row, column = rows + row_offset, columns + column_offset
        open_points = np.nonzero((column >= 0) & (column < width) & ~found)[0]
        keys = row[open_points] * width + column[open_points]
        place = np.minimum(np.searchsorted(squares, keys), len(squares) - 1)
        has_square = squares[place] == keys
        open_points, place = open_points[has_square], place[has_square]
        for offset in range(int((starts[1:] - starts[:-1]).max())):
            index = starts[place] + offset
            is_inside = index < starts[place + 1]
            gaps = points[open_points[is_inside]] - others[order[index[is_inside]]]
            found[open_points[is_inside]] |= np.square(gaps).sum(axis=1) <= limit * limit
    return found


def _sorted_into_squares(points: np.ndarray, side: float) -> Tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Sort points by the squares they are in.

    Returns:
        the order, where each square begins in it and the last ends, the keys of the squares, columns of the raster.
    """
    lowest = points.min(axis=0) - side
    columns, rows = np.floor((points - lowest) / side).astype(int).T
    width = int(columns.max()) + 2
    keys = rows * width + columns
    order = np.argsort(keys, kind='stable')
    squares, starts = np.unique(keys[order], return_index=True)
    return order, np.append(starts, len(points)), squares, width
