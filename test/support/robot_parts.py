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


def write_text_stl(path, corners, triangles):
    facet = ' facet normal 0 0 0\n  outer loop\n   vertex {}\n   vertex {}\n   vertex {}\n  endloop\n endfacet\n'
    texts = [' '.join(map(repr, corner)) for corner in corners.tolist()]
    facets = ''.join(facet.format(*(texts[index] for index in triangle)) for triangle in triangles)
    path.write_text(f'solid part\n{facets}endsolid part\n')


def write_binary_stl(path, corners, triangles, header=b'made by a test'):
    records = np.zeros(len(triangles), [('normal', '<f4', 3), ('corners', '<f4', (3, 3)), ('attribute', '<u2')])
    records['corners'] = corners[triangles]
    path.write_bytes(header.ljust(80) + np.uint32(len(triangles)).tobytes() + records.tobytes())


def write_obj(path, corners, triangles):
    lines = [f'v {x!r} {y!r} {z!r}' for x, y, z in corners.tolist()]
    lines += [f'f {a + 1} {b + 1} {c + 1}' for a, b, c in triangles.tolist()]
    path.write_text('mtllib missing.mtl\nusemtl none\n' + '\n'.join(lines) + '\n')


def write_dae(path, corners, triangles, unit_m=1.0, up_axis='Z_UP', node=''):
    """A scene that shows one part, `node` in its <node>: <translate>, <matrix> and the like."""
    numbers, indices = (' '.join(map(repr, np.ravel(values).tolist())) for values in (corners, triangles))
    path.write_text(f"""<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><created>2024-01-01T00:00:00</created><modified>2024-01-01T00:00:00</modified>
    <unit name="unit" meter="{unit_m}"/><up_axis>{up_axis}</up_axis></asset>
  <library_geometries><geometry id="part" name="part"><mesh>
    <source id="points"><float_array id="array" count="{np.size(corners)}">{numbers}</float_array>
      <technique_common><accessor source="#array" count="{len(corners)}" stride="3">
        <param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
      </accessor></technique_common></source>
    <vertices id="corners"><input semantic="POSITION" source="#points"/></vertices>
    <triangles count="{len(triangles)}"><input semantic="VERTEX" source="#corners" offset="0"/>
      <p>{indices}</p></triangles>
  </mesh></geometry></library_geometries>
  <library_visual_scenes><visual_scene id="scene">
    <node id="n">{node}<instance_geometry url="#part"/></node></visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#scene"/></scene>
</COLLADA>
""")


WRITERS = {
    'text.stl': write_text_stl,
    'binary.stl': write_binary_stl,
    'solid.stl': lambda *given: write_binary_stl(*given, header=b'solid though it is binary'),
    'part.obj': write_obj,
    'part.dae': write_dae,
    'LOUD.STL': write_binary_stl,
}
