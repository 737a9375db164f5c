"""Meshes replaced by the smallest box, cylinder or ball around them, which is what the physics needs."""

from __future__ import annotations

from typing import Iterator, List, NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.enclosing_balls import smallest_ball
from diff_encoder_sim.robots.mesh_corners import MeshFinder, is_listed, link_corners_m, mesh_name
from diff_encoder_sim.robots.robot_tree import Box, Cylinder, Geometry, Link, Mesh, Shape, Sphere
from diff_encoder_sim.robots.solids import volume_m3

_THINNEST_M = 1e-3  # a mesh that is a flat sheet becomes a plate
_DECIMALS = 6  # of a length [m]: STL files hold 24 bits


class Primitives(NamedTuple):
    """Shapes without meshes, in their link, and what was replaced, a line each."""

    shapes: Tuple[Shape, ...]
    notes: Tuple[str, ...]


def primitives_of(link: Link, where: str, find: MeshFinder) -> Primitives:
    """Return a link's collision shapes, each mesh replaced.

    Args:
        link: the link.
        where: begins errors: the robot's file.
        find: finds a mesh's file.

    Raises:
        ConfigError: a mesh is missing, broken or too large.
    """
    shapes: List[Shape] = []
    notes: List[str] = []
    for shape in link.collisions:
        if not isinstance(shape.geometry, Mesh):
            shapes.append(shape)
            continue
        name = mesh_name(shape.geometry.uri)
        shapes.append(mesh_hull(shape, f'{where}: link {link.name!r}', find))
        notes.append(f'collision mesh {name} of link {link.name} is simulated as {in_words(shapes[-1].geometry)}')
    return Primitives(tuple(shapes), tuple(notes))


def visual_primitives_of(link: Link, find: MeshFinder) -> Tuple[Shape, ...]:
    """Return a link's visual shapes, meshes replaced; a mesh that is missing or broken is left out."""
    shapes: List[Shape] = []
    for shape in link.visuals:
        try:
            shapes.append(mesh_hull(shape, link.name, find) if isinstance(shape.geometry, Mesh) else shape)
        except ConfigError:
            continue
    return tuple(shapes)


def mesh_hull(shape: Shape, where: str, find: MeshFinder) -> Shape:
    """Return the smallest box, cylinder or ball that holds a mesh, in the same link.

    Raises:
        ConfigError: the mesh is missing, broken or too large; `where` begins the text.
    """
    assert isinstance(shape.geometry, Mesh)
    uri, turn = shape.geometry.uri, shape.pose_in_link[:3, :3]
    place = f'{where}: collision mesh {(mesh_name(uri) if is_listed(uri) else uri)!r}'
    points_m = link_corners_m(shape, place, find)
    extents_m = np.sort(np.ptp(points_m @ turn, axis=0))
    if extents_m[1] < 0.5 * 10**-_DECIMALS:
        raise ConfigError(f'{place}: given a mesh without extent; allowed: a mesh with a width and a length')
    return min(_candidates(points_m, turn), key=lambda candidate: volume_m3(candidate.geometry))


def in_words(geometry: Geometry) -> str:
    """Return a primitive as users read it."""
    if isinstance(geometry, Box):
        return 'a box of ' + ' x '.join(map(_mm, geometry.size_xyz_m)) + ' mm'
    if isinstance(geometry, Cylinder):
        return f'a cylinder of radius {_mm(geometry.radius_m)} mm, length {_mm(geometry.length_m)} mm'
    assert isinstance(geometry, Sphere)
    return f'a sphere of radius {_mm(geometry.radius_m)} mm'


def _mm(length_m: float) -> str:
    return f'{round(1e3 * length_m, 1):.7g}'


def _candidates(points_m: np.ndarray, mesh_axes: np.ndarray) -> Iterator[Shape]:
    """Yield what holds (n, 3) points of a link: along its axes and the mesh's (columns of (3, 3)), and a ball."""
    for axes in (np.eye(3), mesh_axes):
        yield _box(points_m, axes)
        for axis in range(3):
            yield _cylinder(points_m, np.roll(axes, -1 - axis, axis=1))
    ball = smallest_ball(points_m)
    yield Shape(Sphere(_length_m(ball.radius_m)), _pose(np.eye(3), ball.centre_m))


def _box(points_m: np.ndarray, axes: np.ndarray) -> Shape:
    """Return the box along some axes."""
    low_m, high_m = np.min(points_m @ axes, axis=0), np.max(points_m @ axes, axis=0)
    x_m, y_m, z_m = (_length_m(side_m) for side_m in high_m - low_m)
    return Shape(Box((x_m, y_m, z_m)), _pose(axes, 0.5 * axes @ (low_m + high_m)))


def _cylinder(points_m: np.ndarray, axes: np.ndarray) -> Shape:
    """Return the cylinder along the third of some axes."""
    local_m = points_m @ axes
    circle = smallest_ball(local_m[:, :2])
    low_m, high_m = local_m[:, 2].min(), local_m[:, 2].max()
    centre_m = axes @ np.append(circle.centre_m, 0.5 * (low_m + high_m))
    return Shape(Cylinder(_length_m(circle.radius_m), _length_m(high_m - low_m)), _pose(axes, centre_m))


def _length_m(length_m: float) -> float:
    """Return a length with all digits that a mesh has, none of them noise."""
    return max(round(float(length_m), _DECIMALS), _THINNEST_M)


def _pose(axes: np.ndarray, centre_m: np.ndarray) -> np.ndarray:
    """Return a (4, 4) pose."""
    pose = np.eye(4)
    pose[:3, :3] = axes
    pose[:3, 3] = np.round(centre_m, _DECIMALS) + 0.0  # no -0
    return pose
