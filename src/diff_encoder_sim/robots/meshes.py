"""Collision meshes in STL, OBJ and DAE files: their corners, and primitives in their place."""

from __future__ import annotations

import functools
import io
import math
import re
from pathlib import Path, PurePosixPath
from typing import Callable, Iterator, List, NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.base.errors import ConfigError, in_one_line
from diff_encoder_sim.base.xml_values import parse_numbers
from diff_encoder_sim.robots.robot_tree import Box, Cylinder, Geometry, Link, Mesh, Shape, Sphere
from diff_encoder_sim.robots.solids import smallest_ball, volume_m3

_LARGEST_BYTES = 50_000_000
_DIGITS = 7
_FARTHEST = 1e9  # of a corner, in the file's unit
# A part whose material is missing, often for want of a texture, is a part all the same.
_MATERIALS = re.compile(rb'<(\w+:)?bind_material\b.*?</(\w+:)?bind_material>', re.DOTALL)
# In a text STL or OBJ: names may be in any encoding, numbers are ASCII.
_AS_ASCII = bytes(range(128)) + 128 * b'?'
_BINARY_STL_HEADER = np.dtype([('text', 'S80'), ('triangles', '<u4')])
_BINARY_STL_BYTES = 50  # of a triangle
_SUFFIXES = ('.stl', '.obj', '.dae')


def mesh_points_m(path: Path, where: str) -> np.ndarray:
    """Return the (n, 3) corners of a mesh's convex hull [m], in the file's axes, unscaled.

    Args:
        path: an .stl (binary or text), .obj or .dae file.
        where: begins the error: the robot's file, the link and the mesh.

    Raises:
        ConfigError: there is no such mesh, or none that can be used.
    """
    if not path.is_file():
        raise ConfigError(f'{where}: given {path}, which is no file; allowed: an .stl, .obj or .dae file')
    if path.suffix.lower() not in _SUFFIXES:
        raise ConfigError(f'{where}: given {path.suffix or "no suffix"!r}; allowed: {", ".join(_SUFFIXES)}')
    status = path.stat()
    if status.st_size > _LARGEST_BYTES:
        raise ConfigError(
            f'{where}: given {status.st_size / 1e6:.0f} MB; allowed: up to {_LARGEST_BYTES / 1e6:.0f} MB '
            '(a collision mesh needs few triangles, or is a box, cylinder or sphere)'
        )
    try:
        return _read_once(path, status.st_mtime_ns)
    except ConfigError as error:
        raise ConfigError(f'{where}: {error}') from None


@functools.lru_cache(maxsize=64)
def _read_once(path: Path, _mtime_ns: int) -> np.ndarray:
    """Read and check a mesh; both wheels show the same one, and a robot is described more than once."""
    try:
        points_m = _points_m(path)
    except Exception as error:  # the readers let errors of many types through
        raise ConfigError(f'given no valid mesh ({in_one_line(error)[:200]}); allowed: a readable mesh') from None
    if len(points_m) == 0:
        raise ConfigError('given a mesh without triangles; allowed: at least one')
    if not (np.abs(points_m) < _FARTHEST).all():
        raise ConfigError(f'given corners that are no numbers or enormous; allowed: up to {_FARTHEST:g}')
    outer_m = _outer(np.round(points_m, _decimals(points_m)))
    outer_m.setflags(write=False)
    return outer_m


def _decimals(points_m: np.ndarray) -> int:
    """Return how many decimals say where points are: STL files hold 24 bits, 7 digits."""
    return _DIGITS - math.ceil(math.log10(max(float(np.abs(points_m).max()), 1e-9)))


def _outer(points_m: np.ndarray) -> np.ndarray:
    """Return the corners of the convex hull of (n, 3) points; all points where it is flat."""
    from scipy.spatial import ConvexHull, QhullError  # noqa: PLC0415  a quarter of a second, likewise

    try:
        return np.asarray(points_m[ConvexHull(points_m).vertices])
    except QhullError:
        return np.unique(points_m, axis=0)


def _points_m(path: Path) -> np.ndarray:
    """Read the corners of a mesh."""
    content = path.read_bytes()
    if path.suffix.lower() == '.dae':
        return _dae_points_m(content)
    import trimesh  # noqa: PLC0415  half a second, for robots with meshes only

    if path.suffix.lower() == '.obj' or not _is_binary_stl(content):
        content = content.translate(_AS_ASCII)
    mesh = trimesh.load_mesh(io.BytesIO(content), file_type=path.suffix[1:].lower(), process=False, skip_materials=True)
    return np.asarray(mesh.triangles, float).reshape(-1, 3)


def _is_binary_stl(content: bytes) -> bool:
    size = _BINARY_STL_HEADER.itemsize
    if len(content) < size:
        return False
    triangles = int(np.frombuffer(content, _BINARY_STL_HEADER, 1)['triangles'][0])
    return len(content) == size + _BINARY_STL_BYTES * triangles


def _dae_points_m(content: bytes) -> np.ndarray:
    """Return the corners of all that a DAE's scene shows, by its unit."""
    import collada  # noqa: PLC0415  as above

    document = collada.Collada(io.BytesIO(_MATERIALS.sub(b'', content)), ignore=[collada.common.DaeError])
    parts: List[np.ndarray] = [np.empty((0, 3))]
    for geometry in document.scene.objects('geometry'):
        for primitive in geometry.primitives():
            if primitive.vertex is not None and not isinstance(primitive, collada.lineset.BoundLineSet):
                parts.append(primitive.vertex[np.unique(primitive.vertex_index)])
    return np.vstack(parts).astype(float) * (document.assetInfo.unitmeter or 1.0)


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
