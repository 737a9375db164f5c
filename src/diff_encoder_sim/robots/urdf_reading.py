"""Reads URDF text into a tree of links and joints."""

from __future__ import annotations

import math
from collections import Counter
from pathlib import Path
from typing import Dict, List, Mapping, Optional, Union
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import did_you_mean
from diff_encoder_sim.base.xml_values import bounded_numbers, joint_link, rotation_from_rpy
from diff_encoder_sim.robots.description import Joint, Link, RobotTree
from diff_encoder_sim.robots.solids import Box, Cylinder, Geometry, MassProperties, Mesh, Shape, Sphere

LEAST_M = 1e-9  # of a shape; a smaller one is of size zero
JOINT_KINDS = ('fixed', 'continuous', 'revolute', 'prismatic', 'floating', 'planar')


def read_robot_text(path: Union[str, Path]) -> str:
    """Return an XML file's text without blank lines at its begin, UTF-8 or ISO-8859-1; ConfigError if unreadable."""
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise ConfigError(f'{path}: cannot be read: {error.strerror}; allowed: a .xacro or .urdf file') from None
    try:
        return content.decode('utf-8-sig').lstrip()
    except UnicodeDecodeError:
        return content.decode('iso-8859-1').lstrip()


def parse_robot_xml(text: str, where: str) -> ElementTree.Element:
    """Return the root element, prefixes of tags dropped, as URDF has one vocabulary; ConfigError if it is not XML."""
    builder, parser = ElementTree.TreeBuilder(), expat.ParserCreate('utf-8')
    parser.buffer_text = True
    parser.StartElementHandler = lambda tag, attributes: builder.start(tag.rpartition(':')[2], attributes)
    parser.EndElementHandler = lambda tag: builder.end(tag.rpartition(':')[2])
    parser.CharacterDataHandler = builder.data
    try:
        parser.Parse(text.encode('utf-8', errors='replace'), True)
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        raise ConfigError(f'{where}, line {error.lineno}: not well-formed XML: {reason}') from None
    return builder.close()


def parse_urdf(text: str, where: str) -> RobotTree:
    """Return the tree of a robot by its URDF, xacro expanded; ConfigError, after `where`, unless one tree of links."""
    robot = parse_robot_xml(text, where)
    if robot.tag != 'robot':
        raise ConfigError(f'{where}: given <{robot.tag}>; allowed: a URDF or xacro file, which begins with <robot>')
    notes: List[str] = []
    links = [_link(element, where, notes) for element in robot.findall('link')]
    joints = [_joint(element, where) for element in robot.findall('joint')]
    if not links:
        raise ConfigError(f'{where}: the robot has no link; allowed: the file of a whole robot, not of macros only')
    for kind, names in (('link', [link.name for link in links]), ('joint', [joint.name for joint in joints])):
        repeated = next((name for name, count in Counter(names).items() if count > 1), None)
        if repeated is not None:
            raise ConfigError(f'{where}: {kind} {repeated!r}: given {names.count(repeated)} times; allowed: once')
    by_name = {link.name: link for link in links}
    above: Dict[str, Joint] = {}
    for joint in joints:
        for end, name in (('parent', joint.parent), ('child', joint.child)):
            if name not in by_name:
                hint = did_you_mean(name, by_name)
                raise ConfigError(f'{where}: joint {joint.name!r}: {end}: no link is named {name!r}{hint}')
        if joint.child in above:
            pair = f'{above[joint.child].name!r} and {joint.name!r}'
            raise ConfigError(f'{where}: link {joint.child!r} is the child of two joints, {pair}; allowed: one')
        above[joint.child] = joint
    roots = [name for name in by_name if name not in above]
    if len(roots) > 1:
        given = f'{len(roots)} links hang on no joint: {", ".join(map(repr, roots))}'
        raise ConfigError(f'{where}: {given}; allowed: one, the root of all others')
    name, root = robot.get('name', '').strip() or 'robot', roots[0] if roots else links[0].name
    tree = RobotTree(name, root, by_name, {joint.name: joint for joint in joints}, robot, where, tuple(notes))
    loop = list(by_name) if not roots else [name for name in by_name if name not in tree.poses]
    if loop:
        raise ConfigError(f'{where}: the links {", ".join(map(repr, loop))} form a loop; allowed: a tree')
    return tree


def _name(element: ElementTree.Element, where: str) -> str:
    name = element.get('name', '')
    if not name.strip():
        raise ConfigError(f'{where}: <{element.tag}>: name: missing')
    return name


def _pose(parent: ElementTree.Element, where: str) -> np.ndarray:
    """Return the (4, 4) pose of an element's <origin>, the parent's frame if there is none."""
    pose, origin = np.eye(4), parent.find('origin')
    if origin is not None:
        pose[:3, 3] = bounded_numbers(origin.get('xyz', '0 0 0'), 3, f'{where}: origin xyz')
        pose[:3, :3] = rotation_from_rpy(*bounded_numbers(origin.get('rpy', '0 0 0'), 3, f'{where}: origin rpy'))
    return pose


def _joint(element: ElementTree.Element, where: str) -> Joint:
    name = _name(element, where)
    place = f'{where}: joint {name!r}'
    kind, parent, child = element.get('type', ''), joint_link(element, 'parent'), joint_link(element, 'child')
    if kind not in JOINT_KINDS:
        hint = did_you_mean(kind, JOINT_KINDS)
        raise ConfigError(f'{place}: type: given {kind!r}; allowed: {", ".join(JOINT_KINDS)}{hint}')
    axis_element, axis = element.find('axis'), np.array([1.0, 0.0, 0.0])
    if axis_element is not None and kind not in ('fixed', 'floating'):
        vector = np.array(bounded_numbers(axis_element.get('xyz', '1 0 0'), 3, f'{place}: axis xyz'))
        if np.linalg.norm(vector) < 1e-6:
            raise ConfigError(f'{place}: axis xyz: given {axis_element.get("xyz")!r}; allowed: a direction, not zero')
        axis = vector / float(np.linalg.norm(vector))
    limit = element.find('limit')
    given: Mapping[str, str] = {} if limit is None else limit.attrib
    range_rad = _limit(given, 'upper', 'inf', place) - _limit(given, 'lower', '-inf', place)
    spins = kind == 'continuous' or (kind == 'revolute' and range_rad >= 2.0 * math.pi)
    limits = [_limit(given, key, 'inf', place) for key in ('effort', 'velocity')]
    effort, speed = (value if 0.0 < value < math.inf else None for value in limits)
    is_mimic = element.find('mimic') is not None
    return Joint(name, kind, parent, child, _pose(element, place), axis, effort, speed, is_mimic, spins)


def _limit(given: Mapping[str, str], key: str, default: str, place: str) -> float:
    try:
        return float(given.get(key, default))
    except ValueError:
        raise ConfigError(f'{place}: limit {key}: given {given[key]!r}; allowed: a number') from None


def _link(element: ElementTree.Element, where: str, notes: List[str]) -> Link:
    name = _name(element, where)
    place = f'{where}: link {name!r}'
    collisions = [_shape(each, f'{place}: collision') for each in element.findall('collision')]
    if None in collisions:
        notes.append(f'link {name!r}: a <collision> without a shape or of size zero is ignored')
    inertial = _inertial(element, place)
    if inertial is None and element.find('inertial') is not None:
        notes.append(f'link {name!r}: an <inertial> without mass is ignored')
    visuals = [_shape(each, f'{place}: visual') for each in element.findall('visual')]
    contact, friction = element.find('contact/lateral_friction'), None
    if contact is not None:
        (friction,) = bounded_numbers(contact.get('value'), 1, f'{place}: lateral_friction value')
    return Link(name, inertial, tuple(filter(None, collisions)), tuple(filter(None, visuals)), friction)


def _inertial(link: ElementTree.Element, place: str) -> Optional[MassProperties]:
    inertial, mass = link.find('inertial'), link.find('inertial/mass')
    if inertial is None or mass is None:
        return None
    (mass_kg,) = bounded_numbers(mass.get('value'), 1, f'{place}: mass value')
    if mass_kg < 0:
        raise ConfigError(f'{place}: mass value: given {mass.get("value")!r}; allowed: not negative [kg]')
    element = inertial.find('inertia')
    given = {} if element is None else element.attrib
    xx, xy, xz, yy, yz, zz = (
        bounded_numbers(given.get(key, '0'), 1, f'{place}: inertia {key}')[0]
        for key in ('ixx', 'ixy', 'ixz', 'iyy', 'iyz', 'izz')
    )
    pose = _pose(inertial, f'{place}: inertial')
    turn = pose[:3, :3]
    inertia_kgm2 = turn @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turn.T
    return MassProperties(mass_kg, pose[:3, 3], inertia_kgm2) if mass_kg > 0 else None


def _shape(element: ElementTree.Element, place: str) -> Optional[Shape]:
    """Return a shape; None if it is missing, of an unknown kind, or of size zero."""
    given = element.find('geometry/*')
    if given is None or given.tag not in ('mesh', 'box', 'sphere', 'cylinder', 'capsule'):
        return None
    kind, attributes = given.tag, given.attrib

    def numbers(key: str, count: int = 1, default: Optional[str] = None) -> List[float]:
        return bounded_numbers(attributes.get(key, default), count, f'{place}: {kind} {key}')

    if kind == 'mesh':
        uri, (x, y, z) = attributes.get('filename', '').strip(), numbers('scale', 3, '1 1 1')
        if not uri:
            raise ConfigError(f'{place}: {kind}: filename: missing')
        return Shape(Mesh(uri, (x, y, z)), _pose(element, place))
    if kind == 'box':
        sizes_m = x_m, y_m, z_m = numbers('size', 3)
        made: Geometry = Box((x_m, y_m, z_m))
    else:
        sizes_m = radius_m, length_m = numbers('radius') + (numbers('length') if kind != 'sphere' else [1.0])
        rounded = Cylinder(radius_m, length_m + 2 * radius_m * (kind == 'capsule'))
        made = Sphere(radius_m) if kind == 'sphere' else rounded
    return Shape(made, _pose(element, place)) if min(sizes_m) > LEAST_M else None
