"""Collision meshes in STL, OBJ and DAE files: their corners, and primitives in their place."""

from __future__ import annotations

import functools
import io
import math
import re
from pathlib import Path, PurePosixPath
from typing import Callable, Dict, Iterator, List, Mapping, NamedTuple, Optional, Set, Tuple

import numpy as np

from diff_encoder_sim.base.errors import ConfigError, in_one_line
from diff_encoder_sim.base.xml_values import parse_numbers
from diff_encoder_sim.robots.contacts import CASTER_NAMES
from diff_encoder_sim.robots.description import (
    Box,
    Cylinder,
    Findings,
    Geometry,
    Joint,
    Link,
    Mesh,
    RobotTree,
    Shape,
    Sphere,
)
from diff_encoder_sim.robots.rolling_wheels import UPRIGHT, rigid_links, spins
from diff_encoder_sim.robots.solids import placed, smallest_ball, volume_m3

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


RIM = 0.98  # of the radius: what is farther out rolls
LARGEST_GAP_RAD = 1.2  # between points of the rim, seen from the axle: a hexagon is round, a box is not
NARROWEST_M = 1e-3


def mesh_treads(tree: RobotTree, joint: Joint, link: str, find: MeshFinder, visual: bool) -> Iterator[Shape]:
    """Yield the treads of a link's meshes about a joint that turns it, each a cylinder in the link.

    Args:
        tree: the robot as parsed.
        joint: what turns the link.
        link: the joint's child, or a link fixed to it.
        find: finds a mesh's file.
        visual: whether to look at visual rather than collision meshes; those that cannot be read are left out then.

    Raises:
        ConfigError: a collision mesh cannot be read.
    """
    poses = tree.link_poses()
    to_link = np.linalg.inv(poses[link]) @ poses[joint.child]
    part = tree.links[link]
    for shape in part.visuals if visual else part.collisions:
        try:
            points_m = points_in_link_m(shape, find, f'{tree.where}: link {link!r}')
        except ConfigError:
            if not visual:
                raise
            continue
        tread = None if points_m is None else tread_of(points_m, to_link[:3, 3], to_link[:3, :3] @ joint.axis)
        if tread is not None:
            yield tread


def points_in_link_m(shape: Shape, find: MeshFinder, where: str) -> Optional[np.ndarray]:
    """Return the (n, 3) outer points of a mesh in its link; None of another shape.

    Raises:
        ConfigError: the mesh is missing or cannot be read.
    """
    return link_corners_m(shape, where, find) if isinstance(shape.geometry, Mesh) else None


def tread_of(points_m: np.ndarray, centre_m: np.ndarray, axis: np.ndarray) -> Optional[Shape]:
    """Return the cylinder on which (n, 3) points roll about an axis (3,) through a point (3,); None if not round."""
    across, up = _perpendiculars(axis)
    from_axle_m = points_m - centre_m
    along_m = from_axle_m @ axis
    x_m, y_m = from_axle_m @ across, from_axle_m @ up
    radii_m = np.hypot(x_m, y_m)
    rim = radii_m > RIM * radii_m.max()
    bearings_rad = np.sort(np.arctan2(y_m[rim], x_m[rim]))
    if np.diff(bearings_rad, append=bearings_rad[0] + 2.0 * np.pi).max() > LARGEST_GAP_RAD:
        return None
    low_m, high_m = float(along_m[rim].min()), float(along_m[rim].max())
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([across, up, axis])
    pose[:3, 3] = centre_m + 0.5 * (low_m + high_m) * axis
    return Shape(Cylinder(round(float(radii_m.max()), 6), max(high_m - low_m, NARROWEST_M)), pose)


def _perpendiculars(axis: np.ndarray) -> np.ndarray:
    """Return two (3,) unit vectors that make a right-handed frame with an axis as its third."""
    across = np.cross(np.eye(3)[np.abs(axis).argmin()], axis)
    across /= np.linalg.norm(across)
    return np.array([across, np.cross(axis, across)])


LARGEST_MASS = 0.2  # of the robot's mass: a heavier part is its body
_ON_THE_FLOOR = re.compile('cast[eo]r|ball|skid|wheel|roller|slider|foot', re.IGNORECASE)

_Faults = Dict[str, str]  # by the mesh's URI


def without_unread_meshes(tree: RobotTree, find: MeshFinder, seen: Findings) -> RobotTree:
    """Return the robot without the collision meshes of accessories that cannot be read, each with a warning.

    They are removed from the tree's XML, too. Meshes of wheels, casters and the body stay: there they are errors.
    """
    unread = {
        name: faults for name, faults in ((name, _faults(link, find)) for name, link in tree.links.items()) if faults
    }
    if not unread:
        return tree
    parts, carriers = _wheel_links(tree)
    masses_kg = {name: link.inertial.mass_kg for name, link in tree.links.items() if link.inertial is not None}
    body_kg = LARGEST_MASS * sum(masses_kg.values())
    for name in list(unread):
        if name in parts | carriers or masses_kg.get(name, 0.0) > body_kg or _ON_THE_FLOOR.search(name):
            del unread[name]
    links = {
        name: link._replace(
            collisions=tuple(each for each in link.collisions if _uri(each) not in unread.get(name, {}))
        )
        for name, link in tree.links.items()
    }
    if not any(link.collisions for name, link in links.items() if name not in parts):
        return tree  # nothing else has a shape
    for name, faults in unread.items():
        for uri, fault in faults.items():
            seen.warn(f'collision mesh {uri!r} of link {name!r} is left out: {fault}')
    for element in tree.xml.findall('link'):
        for collision in element.findall('collision'):
            mesh = collision.find('geometry/mesh')
            if mesh is not None and mesh.get('filename', '').strip() in unread.get(element.get('name', ''), {}):
                element.remove(collision)
    return tree._replace(links=links)


def _faults(link: Link, find: MeshFinder) -> _Faults:
    found: _Faults = {}
    for uri in filter(None, map(_uri, link.collisions)):
        try:
            file_corners_m(uri, '', find)
        except ConfigError as error:
            found[uri] = str(error).lstrip(': ')
    return found


def _uri(shape: Shape) -> str:
    return shape.geometry.uri if isinstance(shape.geometry, Mesh) else ''


def _wheel_links(tree: RobotTree) -> Tuple[Set[str], Set[str]]:
    """Return the links that are wheels or parts of them, and the links that carry these, the root included."""
    poses, above = tree.link_poses(), {joint.child: joint for joint in tree.joints.values()}
    parts: Set[str] = set()
    carriers = {tree.root}
    for name in list(poses)[1:]:  # parents first
        joint = above[name]
        is_level = abs((poses[name][:3, :3] @ joint.axis)[2]) <= UPRIGHT
        if joint.parent in parts or (is_level and spins(tree, joint)):
            parts.add(name)
    for name in reversed(list(poses)[1:]):
        if name in parts | carriers:
            carriers.add(above[name].parent)
    return parts, carriers


class BodyShape(NamedTuple):
    """A shape in the root, with its link."""

    link: str
    shape: Shape


def primitive_tree(tree: RobotTree, find: MeshFinder, seen: Findings) -> RobotTree:
    """Return the robot with its collision meshes replaced, and visual shapes only where they are needed.

    Visual meshes are large, and say less: they stand in for a wheel that has no round collision shape, for a caster
    that has none, and for a robot that has none at all.

    Raises:
        ConfigError: a collision mesh is missing, broken or too large.
    """
    links: Dict[str, Link] = {}
    for name, link in tree.links.items():
        shapes, notes = primitives_of(link, tree.where, find)
        links[name] = link._replace(collisions=shapes, visuals=())
        for note in notes:
            seen.note(note)
    wheels = _add_treads(tree, links, find)
    has_body = any(links[name].collisions for name in links if name not in wheels)
    if not has_body:
        seen.warn('no link but the wheels has a collision shape: visual shapes are taken')
    for name, link in links.items():
        if not link.visuals and (not has_body or (CASTER_NAMES.search(name) and not link.collisions)):
            links[name] = link._replace(visuals=visual_primitives_of(tree.links[name], find))
    return tree._replace(links=links)


def _add_treads(tree: RobotTree, links: Dict[str, Link], find: MeshFinder) -> Set[str]:
    """Add treads to the wheels' meshes, and visual shapes to wheels that are not round; return the wheels' links."""
    wheels: Set[str] = set()
    for joint in tree.joints.values():
        for name in rigid_links(tree, joint.child) if spins(tree, joint) else ():
            link = links[name]
            link = link._replace(collisions=(*link.collisions, *mesh_treads(tree, joint, name, find, visual=False)))
            if not _is_round(link):
                shapes = visual_primitives_of(tree.links[name], find)
                link = link._replace(visuals=(*shapes, *mesh_treads(tree, joint, name, find, visual=True)))
            links[name] = link
            wheels.add(name)
    return wheels


def collision_shapes(tree: RobotTree) -> Dict[str, Tuple[Shape, ...]]:
    """Return each link's collision shapes, in the link."""
    return {name: link.collisions for name, link in tree.links.items()}


def shape_points_m(tree: RobotTree, find: MeshFinder, link: str, number: int) -> Optional[np.ndarray]:
    """Return the (n, 3) outer points of a link's collision mesh in the link; None where that shape is no mesh."""
    shapes = tree.links[link].collisions
    return points_in_link_m(shapes[number], find, tree.where) if number < len(shapes) else None


def body_shapes(tree: RobotTree, poses: Mapping[str, np.ndarray]) -> List[BodyShape]:
    """Return the shapes of all links in the root: collision shapes, or visual ones where a link has none."""
    return [
        BodyShape(name, placed(shape, pose))
        for name, pose in poses.items()
        for shape in tree.links[name].collisions or tree.links[name].visuals
    ]


def _is_round(link: Link) -> bool:
    return any(isinstance(shape.geometry, (Cylinder, Sphere)) for shape in link.collisions)
