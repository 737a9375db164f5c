"""Accuracy of an occupancy grid, against the world's geometry."""

from __future__ import annotations

import itertools
import math
from typing import List, NamedTuple, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.occupancy_grid import OCCUPIED, OccupancyGrid
from diff_encoder_sim.simulation.lidar import cast_rays, cut_world
from diff_encoder_sim.simulation.rasterise import rasterise, surface_points
from diff_encoder_sim.simulation.world import World

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
