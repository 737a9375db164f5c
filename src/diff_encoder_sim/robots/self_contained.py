"""A robot's URDF without other files: what Dask workers get."""

from __future__ import annotations

import re
from xml.etree import ElementTree

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.findings import Findings
from diff_encoder_sim.robots.mesh_corners import MeshFinder, file_corners_m, is_listed, listed_mesh
from diff_encoder_sim.robots.primitive_tree import primitive_tree
from diff_encoder_sim.robots.unread_meshes import without_unread_meshes
from diff_encoder_sim.robots.urdf_parsing import parse_urdf

# Signs that a xacro or URDF depends on more than its own text and arguments: other files, the environment.
_NEEDS_OTHERS = re.compile(r'include|load_yaml|<mesh|\$\((?!arg\b)')


def needs_other_files(text: str) -> bool:
    """Say whether a xacro or URDF may mean something else, or nothing, on another machine."""
    return _NEEDS_OTHERS.search(text) is not None


def self_contained_urdf(urdf: str, where: str, find: MeshFinder) -> str:
    """Return a URDF with the outer corners of its meshes in place of their files' names.

    What is found out about a robot is the same with it as with the meshes. So all collision meshes are written out, and
    the visual meshes of links whose visual shapes count; other visual meshes keep their names. Without any such mesh
    it is the text as it is.

    Args:
        urdf: the XML, xacro expanded.
        where: begins errors: the robot's file.
        find: finds a mesh's file.

    Raises:
        ConfigError: a collision mesh is missing, broken or too large.
    """
    tree = parse_urdf(urdf, where)
    left_out = Findings()
    simple = primitive_tree(without_unread_meshes(tree, find, left_out), find, Findings())
    is_changed = bool(left_out.warnings)
    for link in tree.xml.findall('link'):
        kinds = ('collision', 'visual') if simple.links[link.get('name', '')].visuals else ('collision',)
        meshes = [mesh for kind in kinds for mesh in link.findall(f'{kind}/geometry/mesh')]
        for mesh in meshes:
            is_changed |= _list_corners(mesh, where, find)
    return ElementTree.tostring(tree.xml, encoding='unicode') if is_changed else urdf


def _list_corners(mesh: ElementTree.Element, where: str, find: MeshFinder) -> bool:
    """Put a mesh's corners in place of its file's name; say whether that was needed and possible."""
    uri = mesh.get('filename', '').strip()
    if is_listed(uri):
        return False
    try:
        mesh.set('filename', listed_mesh(uri, file_corners_m(uri, where, find)))
    except ConfigError:  # of a visual mesh: it does not count here either
        return False
    return True
