"""Poses, shapes and mesh files, for the tests of robots/."""

from pathlib import Path

import numpy as np

from diff_encoder_sim.base.xml_values import rotation_from_rpy
from diff_encoder_sim.robots.solids import Shape, pose_at

# Corners of a cube of edge 2 around the origin, and its twelve triangles.
CUBE_CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
CUBE_TRIANGLES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4]]
    + [[1, 5, 7], [1, 7, 3]]
)


def pose(xyz_m=(0, 0, 0), rpy_rad=(0, 0, 0)):
    return pose_at(xyz_m, rotation_from_rpy(*rpy_rad))


def shape(geometry, xyz_m=(0, 0, 0), rpy_rad=(0, 0, 0)):
    return Shape(geometry, pose(xyz_m, rpy_rad))


def random_rotation(rng):
    rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return rotation * np.linalg.det(rotation)


def random_pose(rng):
    return pose_at(rng.normal(size=3), random_rotation(rng))


def finder(folder):
    """Finds `package://any/NAME` in a folder, as find_mesh does."""
    return lambda uri: Path(folder) / uri.rsplit('/', 1)[-1]


def write_mesh(path, corners, triangles, kind='stl'):
    """Write a binary STL, or another kind of trimesh's: stl_ascii, obj."""
    import trimesh

    trimesh.Trimesh(corners, triangles, process=False).export(path, file_type=kind)
