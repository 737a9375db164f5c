"""Meshes in STL, OBJ and DAE files: their corners, and primitives in their place."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import io
import math
import re
from pathlib import Path, PurePosixPath
from typing import Callable, Dict, List, Optional, Set, Tuple

import numpy as np

from diff_encoder_sim.base.errors import ConfigError, in_one_line
from diff_encoder_sim.robots.contacts import CASTER_NAMES
from diff_encoder_sim.robots.description import UPRIGHT, Findings, Link, RobotTree
from diff_encoder_sim.robots.solids import Box, Cylinder, Geometry, Mesh, Shape, Sphere, measures, pose_at

# Finds a mesh's file by its URI, as xacro_expansion.find_mesh. It raises ConfigError, or returns None, if the file is
# missing.
MeshFinder = Callable[[str], Optional[Path]]

_DIGITS = 7  # STL files hold 24 bits
_FARTHEST = 1e9  # of a corner, in the file's unit
# A part whose material is missing, often for want of a texture, is a part all the same.
_MATERIALS = re.compile(rb'<(\w+:)?bind_material\b.*?</(\w+:)?bind_material>', re.DOTALL)
# In a text STL or OBJ: names may be in any encoding, numbers are ASCII.
_AS_ASCII = bytes(range(128)) + 128 * b'?'

_THINNEST_M = 1e-3  # a mesh that is a flat sheet becomes a plate
_DECIMALS = 6  # of a length [m]

LARGEST_MASS = 0.2  # of the robot's mass: a heavier part is its body
_ON_THE_FLOOR = re.compile('cast[eo]r|ball|skid|wheel|roller|slider|foot', re.IGNORECASE)


@functools.lru_cache(maxsize=64)  # both wheels show the same mesh, and a robot is described more than once
def _hull_points_m(path: Path, _mtime_ns: int) -> np.ndarray:
    """Read the corners of a mesh's hull; of a DAE all that its scene shows, by its unit."""
    from scipy.spatial import ConvexHull, QhullError  # noqa: PLC0415  a quarter of a second, for meshes only

    content, kind = path.read_bytes(), path.suffix.lower()
    if kind == '.dae':
        import collada  # noqa: PLC0415  likewise

        document = collada.Collada(io.BytesIO(_MATERIALS.sub(b'', content)), ignore=[collada.common.DaeError])
        parts = [np.empty((0, 3))]
        for geometry in document.scene.objects('geometry'):
            for primitive in geometry.primitives():
                if primitive.vertex is not None and not isinstance(primitive, collada.lineset.BoundLineSet):
                    parts.append(primitive.vertex[np.unique(primitive.vertex_index)])
        points_m = np.vstack(parts).astype(float) * (document.assetInfo.unitmeter or 1.0)
    else:
        import trimesh  # noqa: PLC0415  half a second, likewise

        # A binary STL has a header of 80 bytes, the number of triangles, and 50 bytes for each.
        is_binary = len(content) >= 84 and len(content) == 84 + 50 * int.from_bytes(content[80:84], 'little')
        if kind == '.obj' or not is_binary:
            content = content.translate(_AS_ASCII)
        mesh = trimesh.load_mesh(io.BytesIO(content), file_type=kind[1:], process=False, skip_materials=True)
        points_m = np.asarray(mesh.triangles, float).reshape(-1, 3)
    if len(points_m) == 0 or not (np.abs(points_m) < _FARTHEST).all():
        raise ValueError(f'no triangles, or corners farther than {_FARTHEST:g}')
    decimals = _DIGITS - math.ceil(math.log10(max(float(np.abs(points_m).max()), 1e-9)))
    points_m = np.round(points_m, decimals)
    try:
        outer_m = np.asarray(points_m[ConvexHull(points_m).vertices])
    except QhullError:  # flat
        outer_m = np.unique(points_m, axis=0)
    outer_m.setflags(write=False)
    return outer_m


def file_corners_m(uri: str, where: str, find: MeshFinder) -> np.ndarray:
    """Return (n, 3) corners [m] of a mesh's convex hull, unscaled; ConfigError, after `where`, if missing or broken."""
    try:
        path = find(uri)
    except ConfigError as error:
        raise ConfigError(f'{where}: {error}') from None
    if path is None or not path.is_file():
        raise ConfigError(f'{where}: given a file that is missing; allowed: an .stl, .obj or .dae file')
    try:
        return _hull_points_m(path, path.stat().st_mtime_ns)
    except Exception as error:  # the readers let errors of many types through
        given = f'given no valid mesh ({in_one_line(error)[:200]})'
        raise ConfigError(f'{where}: {given}; allowed: a readable mesh') from None


def mesh_hull(shape: Shape, where: str, find: MeshFinder) -> Shape:
    """Return the smallest box, cylinder or ball that holds a mesh, in the same link, and the mesh's corners.

    Boxes and cylinders are along the axes of the link or of the mesh. A shape that is no mesh stays. ConfigError if the
    mesh is missing or broken; `where` begins the text.
    """
    if not isinstance(shape.geometry, Mesh):
        return shape
    uri, turn = shape.geometry.uri, shape.pose_in_link[:3, :3]
    place = f'{where}: collision mesh {uri!r}'
    corners_m = file_corners_m(uri, place, find) * shape.geometry.scale_xyz
    points_m = corners_m @ turn.T + shape.pose_in_link[:3, 3]
    if np.sort(np.ptp(points_m @ turn, axis=0))[1] < 0.5 * 10**-_DECIMALS:
        raise ConfigError(f'{place}: given a mesh without extent; allowed: a mesh with a width and a length')

    def length_m(length_m: float) -> float:  # with all digits that a mesh has, none of them noise
        return max(round(float(length_m), _DECIMALS), _THINNEST_M)

    candidates: List[Tuple[Geometry, np.ndarray, np.ndarray]] = []  # with axes and centre
    for box_axes in (np.eye(3), turn):
        low_m, high_m = np.min(points_m @ box_axes, axis=0), np.max(points_m @ box_axes, axis=0)
        x_m, y_m, z_m = map(length_m, high_m - low_m)
        candidates.append((Box((x_m, y_m, z_m)), box_axes, 0.5 * box_axes @ (low_m + high_m)))
        for axes in (np.roll(box_axes, -1 - axis, axis=1) for axis in range(3)):  # a cylinder along the third
            local_m = points_m @ axes
            centre_m, radius_m = _ball_about_middle(local_m[:, :2])
            bottom_m, top_m = local_m[:, 2].min(), local_m[:, 2].max()
            cylinder = Cylinder(length_m(radius_m), length_m(top_m - bottom_m))
            candidates.append((cylinder, axes, axes @ np.append(centre_m, 0.5 * (bottom_m + top_m))))
    centre_m, radius_m = _ball_about_middle(points_m)
    candidates.append((Sphere(length_m(radius_m)), np.eye(3), centre_m))
    geometry, axes, centre_m = min(candidates, key=lambda candidate: measures(candidate[0])[0])
    return Shape(geometry, pose_at(np.round(centre_m, _DECIMALS) + 0.0, axes), points_m)  # no -0


def _ball_about_middle(points_m: np.ndarray) -> Tuple[np.ndarray, float]:
    """Return centre (d,) and radius of the ball around (n, d) points about the middle of their bounding box."""
    centre_m = 0.5 * (points_m.min(axis=0) + points_m.max(axis=0))
    return centre_m, float(np.linalg.norm(points_m - centre_m, axis=1).max())


def _links_with_needed_meshes(tree: RobotTree) -> Set[str]:
    """Return the links whose collision meshes must be there: the body, wheels, casters, and links that carry these."""
    turning = {each.name for each in tree.joints.values() if each.spins and abs(tree.axis_in_root(each)[2]) <= UPRIGHT}
    above = {name: list(tree.joints_above(name)) for name in tree.links}
    wheels = {name for name, joints in above.items() if any(joint.name in turning for joint in joints)}
    masses_kg = {name: link.inertial.mass_kg for name, link in tree.links.items() if link.inertial is not None}
    heavy = {name for name, mass_kg in masses_kg.items() if mass_kg > LARGEST_MASS * sum(masses_kg.values())}
    needed = {tree.root, *wheels, *heavy, *filter(_ON_THE_FLOOR.search, tree.links)}
    needed.update(joint.parent for name in wheels for joint in above[name])
    others = [(name, shape) for name, link in tree.links.items() if name not in wheels for shape in link.collisions]
    has_body = any(name in needed or not isinstance(shape.geometry, Mesh) for name, shape in others)
    return needed if has_body else set(tree.links)


def primitive_tree(tree: RobotTree, find: MeshFinder, seen: Findings) -> RobotTree:
    """Return the robot with its collision meshes replaced, and visual shapes only if they are needed.

    Collision meshes of accessories that cannot be read are left out, each with a warning. Visual meshes are large and
    less exact: they stand in for a wheel without a round collision shape, for a caster without any, and for a robot
    without any. ConfigError if a collision mesh of the body, a wheel or a caster is missing or broken.
    """
    links: Dict[str, Link] = {}
    needed = _links_with_needed_meshes(tree)
    for name, link in tree.links.items():
        shapes: List[Shape] = []
        for shape in link.collisions:
            uri = shape.geometry.uri if isinstance(shape.geometry, Mesh) else ''
            try:
                shapes.append(mesh_hull(shape, f'{tree.where}: link {name!r}', find))
            except ConfigError as error:
                if name in needed:
                    raise
                fault = str(error).split(': ', 3)[-1]
                seen.warn(f'collision mesh {uri!r} of link {name!r} is left out: {fault}')
                continue
            if uri:
                mesh, solid = PurePosixPath(uri).name, shapes[-1].geometry
                seen.note(f'collision mesh {mesh} of link {name} is simulated as {solid}')
        links[name] = link._replace(collisions=tuple(shapes), visuals=())

    def show(name: str) -> None:
        """Take a link's visual shapes, without meshes that are missing or broken."""
        shapes: List[Shape] = []
        for shape in tree.links[name].visuals:
            with contextlib.suppress(ConfigError):
                shapes.append(mesh_hull(shape, name, find)._replace(corners_m=None))
        links[name] = links[name]._replace(visuals=tuple(shapes))

    wheels = {
        name for joint in tree.joints.values() if joint.spins for name in tree.subtree(joint.child, is_rigid=True)
    }
    for name in wheels:
        if not any(isinstance(shape.geometry, (Cylinder, Sphere)) for shape in links[name].collisions):
            show(name)
    has_body = any(links[name].collisions for name in links if name not in wheels)
    if not has_body:
        seen.warn('no link but the wheels has a collision shape: visual shapes are taken')
    for name, link in links.items():
        if not link.visuals and (not has_body or (CASTER_NAMES.search(name) and not link.collisions)):
            show(name)
    return dataclasses.replace(tree, links=links)
