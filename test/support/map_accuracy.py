"""How true a map is to its world: which of its cells are walls, and how much of what was seen is mapped."""

import itertools
import math
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from diff_encoder_sim.localization.occupancy_grid import OCCUPIED
from diff_encoder_sim.simulation.lidar import cast_rays, cut_world
from diff_encoder_sim.simulation.rasterise import rasterise, surface_points

SPACING_M = 0.01  # between the points of a surface
RASTER_M = 0.05  # cells that find which surfaces face the free space
ROUNDING_CELLS = 1e-6


class MapAccuracy(NamedTuple):
    """A map compared with the true surfaces; distances are between centres of cells."""

    occupied_cells: int
    correct_fraction: float  # of occupied cells: a cell that a true surface crosses or touches is near
    close_fraction: float  # of occupied cells, more strictly: the centre is near a true surface
    mapped_fraction: float  # of the visible surface's length: an occupied cell is near


def map_accuracy(grid, map_pose_in_world, surface_m, visible_m, near_m):
    """Compare a map with points (n, 2) of every surface, and (m, 2) of those that could be seen."""
    rows, columns = np.nonzero(grid.cells == OCCUPIED)
    occupied = np.column_stack([columns, rows]) + 0.5
    if len(occupied) == 0:
        return MapAccuracy(0, math.nan, math.nan, 0.0)
    grid_pose = map_pose_in_world.compose(grid.origin)
    surface, visible = (_in_cells(points, grid_pose, grid.resolution_m) for points in (surface_m, visible_m))
    near_cells = near_m / grid.resolution_m
    is_mapped = [_is_near(cells, occupied, near_cells) for cells in _touched_cells(visible)]
    return MapAccuracy(
        len(occupied),
        float(_is_near(occupied, np.concatenate(_touched_cells(surface)), near_cells).mean()),
        float(_is_near(occupied, surface, near_cells).mean()),
        float(np.any(is_mapped, axis=0).mean()),
    )


def true_surface(world, height_m, free_x_m, free_y_m):
    """(n, 2) points [m] of the surfaces around a free point, in the world frame; without those inside walls."""
    points_m = surface_points(world, height_m, SPACING_M)
    raster = rasterise(world, height_m, RASTER_M, free_x_m, free_y_m)
    columns, rows = np.floor(_in_cells(points_m, raster.origin, RASTER_M) + 1e-9).astype(int).T
    return points_m[raster.cells[rows, columns] == OCCUPIED]


def visible_points(world, height_m, surface_m, laser_poses_in_world, bearings_rad, range_m):
    """(m, 2) points of a surface that a scanner without noise hits from these poses."""
    segments, circles = cut_world(world, height_m)
    ends = []
    for pose in laser_poses_in_world:
        directions_rad = pose.yaw_rad + bearings_rad
        ranges_m = cast_rays(pose.x_m, pose.y_m, directions_rad, segments, circles)
        is_hit = ranges_m < range_m
        unit_vectors = np.column_stack([np.cos(directions_rad[is_hit]), np.sin(directions_rad[is_hit])])
        ends.append(pose[:2] + ranges_m[is_hit, np.newaxis] * unit_vectors)
    return surface_m[_is_near(surface_m / SPACING_M, np.concatenate(ends) / SPACING_M, 1.0)]


def _in_cells(points_m, origin, cell_m):
    """Points (n, 2) of the frame in which `origin` is given, as columns and rows, not rounded."""
    cos_yaw, sin_yaw = math.cos(origin.yaw_rad), math.sin(origin.yaw_rad)
    return (points_m - origin[:2]) @ [[cos_yaw, -sin_yaw], [sin_yaw, cos_yaw]] / cell_m


def _touched_cells(points):
    """Centres (n, 2) of the cells of points on each side of a border: rounding must not decide between them."""
    sides = itertools.product((-ROUNDING_CELLS, ROUNDING_CELLS), repeat=2)
    return [np.floor(points + side) + 0.5 for side in sides]


def _is_near(points, others, distance):
    """Whether each point (n, 2) has one of the others (m, 2) within a distance."""
    limit = distance * (1.0 + ROUNDING_CELLS) + ROUNDING_CELLS
    return np.isfinite(cKDTree(others).query(points, distance_upper_bound=limit)[0])
