"""The outermost points of meshes in STL, OBJ and DAE files.

A DAE is scaled by its <unit>; its <up_axis> is left alone, as RViz (https://github.com/ros-visualization/rviz/issues/1045,
pull request 1689) and Gazebo Classic (https://github.com/gazebosim/gazebo-classic/issues/1305) do.
"""

from __future__ import annotations

import functools
import io
import math
import re
from pathlib import Path
from typing import Any, Dict, List

import numpy as np

from diff_encoder_sim.base.errors import ConfigError, in_one_line

_LARGEST_BYTES = 50_000_000
# As many as an STL of that size has; a DAE may show one part any number of times.
_MOST_POINTS = 3_000_000
# Nodes that a DAE's scene shows, instances written out; instances in its text; corners and indices that are read.
_MOST_NODES, _MOST_INSTANCES, _MOST_NUMBERS = 100_000, 2000, 100_000_000
_DIGITS = 7
_FARTHEST = 1e9  # of a corner, in the file's unit
# A part whose material is missing, often for want of a texture, is a part all the same.
_MATERIALS = re.compile(rb'<(\w+:)?bind_material\b.*?</(\w+:)?bind_material>', re.DOTALL)
# In a text STL or OBJ: names may be in any encoding, numbers are ASCII.
_AS_ASCII = bytes(range(128)) + 128 * b'?'
_BINARY_STL_HEADER = np.dtype([('text', 'S80'), ('triangles', '<u4')])
_BINARY_STL_BYTES = 50  # of a triangle
_INSTANCE = re.compile(rb'<(\w+:)?instance_node\b')
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

    text = content.replace(b'\0', b'')  # in UTF-16, too
    if b'<!ENTITY' in text:
        raise ValueError('it declares entities')
    if len(_INSTANCE.findall(text)) > _MOST_INSTANCES:
        raise ValueError(f'more than {_MOST_INSTANCES} instances of nodes')
    document = collada.Collada(io.BytesIO(_MATERIALS.sub(b'', content)), ignore=[collada.common.DaeError])
    known: Dict[int, int] = {}
    if sum(_shown_nodes(node, known) for node in document.scene.nodes) > _MOST_NODES:
        raise ValueError(f'more than {_MOST_NODES} nodes, with instances written out')
    parts: List[np.ndarray] = [np.empty((0, 3))]
    count = numbers = 0
    for geometry in document.scene.objects('geometry'):
        for primitive in geometry.primitives():
            if primitive.vertex is None or isinstance(primitive, collada.lineset.BoundLineSet):
                continue
            numbers += len(primitive.vertex) + len(primitive.vertex_index)
            parts.append(primitive.vertex[np.unique(primitive.vertex_index)])
            count += len(parts[-1])
            if count > _MOST_POINTS or numbers > _MOST_NUMBERS:
                raise ValueError(f'more than {_MOST_POINTS} corners')
    return np.vstack(parts).astype(float) * (document.assetInfo.unitmeter or 1.0)


def _shown_nodes(node: Any, known: Dict[int, int]) -> int:
    """Return the number of nodes that a node of a scene stands for; `known` has those of nodes which were counted."""
    node = getattr(node, 'node', node)  # of an instance
    if id(node) not in known:
        known[id(node)] = 1 + sum(_shown_nodes(each, known) for each in getattr(node, 'children', ()))
    return known[id(node)]
