"""Corners of the meshes that a robot names: in files, or written into the URDF itself."""

from __future__ import annotations

from pathlib import Path, PurePosixPath
from typing import Callable, Optional

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.xml_values import parse_numbers
from diff_encoder_sim.robots.meshes import mesh_points_m
from diff_encoder_sim.robots.robot_tree import Mesh, Shape

# Finds a mesh's file by its URI: package_search.find_mesh of a robot. It raises ConfigError, or returns None, if the
# file is missing.
MeshFinder = Callable[[str], Optional[Path]]

# A mesh whose corners its URI lists: corners:NAME:x y z x y z ...
_LISTED = 'corners:'


def listed_mesh(uri: str, corners_m: np.ndarray) -> str:
    """Return the URI of a mesh that lists its (n, 3) corners, all digits, under the name of its file."""
    return f'{_LISTED}{mesh_name(uri).replace(":", "_")}:' + ' '.join(map(repr, corners_m.ravel().tolist()))


def is_listed(uri: str) -> bool:
    """Say whether a URI lists the mesh's corners."""
    return uri.startswith(_LISTED)


def mesh_name(uri: str) -> str:
    """Return the name of a mesh's file, without folders."""
    return uri.split(':', 2)[1] if is_listed(uri) else PurePosixPath(uri).name


def file_corners_m(uri: str, where: str, find: MeshFinder) -> np.ndarray:
    """Return the (n, 3) corners of a mesh's convex hull [m], in the mesh's own axes, unscaled.

    Raises:
        ConfigError: the mesh is missing, broken or too large; `where` begins the text.
    """
    if is_listed(uri):
        numbers = uri.split(':', 2)[-1]
        return np.array(parse_numbers(numbers, max(3, len(numbers.split()) // 3 * 3), where)).reshape(-1, 3)
    try:
        path = find(uri)
    except ConfigError as error:
        raise ConfigError(f'{where}: {error}') from None
    if path is None:
        raise ConfigError(f'{where}: given a file that is missing')
    return mesh_points_m(path, where)


def link_corners_m(shape: Shape, where: str, find: MeshFinder) -> np.ndarray:
    """Return the (n, 3) corners of a mesh's convex hull in its link [m].

    Raises:
        ConfigError: the mesh is missing, broken or too large; `where` begins the text.
    """
    assert isinstance(shape.geometry, Mesh)
    corners_m = file_corners_m(shape.geometry.uri, where, find) * shape.geometry.scale_xyz
    return np.asarray(corners_m @ shape.pose_in_link[:3, :3].T + shape.pose_in_link[:3, 3])
