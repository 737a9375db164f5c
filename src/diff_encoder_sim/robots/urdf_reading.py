"""Reads URDF text into a tree of links and joints."""

from __future__ import annotations

import math
import re
from collections import Counter
from pathlib import Path
from typing import Dict, List, Optional, Sequence, Union
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import did_you_mean
from diff_encoder_sim.base.xml_values import bounded_numbers, joint_link, rotation_from_rpy
from diff_encoder_sim.robots.description import (
    Box,
    Cylinder,
    Geometry,
    Joint,
    Link,
    MassProperties,
    Mesh,
    RobotTree,
    Shape,
    Sphere,
)

MOST_BYTES = 20_000_000
LONGEST_NAME = 255  # PyBullet has no room for more
MOST_LINKS = 1000
LEAST_KG = 1e-9  # of a link that has a mass
LEAST_M = 1e-9  # of a shape; a smaller one is of size zero
JOINT_KINDS = ('fixed', 'continuous', 'revolute', 'prismatic', 'floating', 'planar')

_DECLARATION = re.compile(r'<\?xml\s.*?\?>', re.DOTALL)
_ENCODING = re.compile(rb'<\?xml\s[^>]*encoding\s*=\s*["\']([\w.-]+)')


def read_robot_text(path: Union[str, Path]) -> str:
    """Return the text of an XML file without its declaration, lines at their numbers.

    A byte order mark, blank lines or comments before the declaration do no harm then, nor do stray bytes in a comment.

    Raises:
        ConfigError: the file is missing, too big, or not text.
    """
    path = Path(path)
    if not path.is_file():
        raise ConfigError(f'{path}: no such robot file; allowed: a .xacro or .urdf file')
    try:
        content = path.read_bytes()
    except OSError as error:
        raise ConfigError(f'{path}: cannot be read: {error.strerror}') from None
    if len(content) > MOST_BYTES:
        raise ConfigError(f'{path}: too big; allowed: at most {MOST_BYTES // 10**6} MB')
    declared = _ENCODING.search(content, 0, 1000)
    if b'\0' in content:
        raise ConfigError(f'{path}: a binary file; allowed: a xacro or URDF file')
    try:
        text = content.decode(declared[1].decode() if declared else 'utf-8', errors='replace')
    except (LookupError, UnicodeError):
        raise ConfigError(f'{path}: encoding: unknown; allowed: utf-8, iso-8859-1 and the like') from None
    return _DECLARATION.sub(lambda match: '\n' * match.group().count('\n'), text.lstrip('\ufeff'), count=1)


def parse_robot_xml(text: str, where: str) -> ElementTree.Element:
    """Return the root element; prefixes of tags are dropped, declared or not, as URDF has one vocabulary.

    Raises:
        ConfigError: the text is not XML, or declares entities.
    """

    def refuse_entity(name: str, *_: object) -> None:
        raise ConfigError(f'{where}: declares the XML entity {name!r}; allowed: no entities')

    builder = ElementTree.TreeBuilder()
    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.EntityDeclHandler = refuse_entity
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
    """Return the tree of a robot.

    Args:
        text: URDF, xacro expanded.
        where: the robot's file, which begins each error.

    Raises:
        ConfigError: the text is not the URDF of one tree of links.
    """
    robot = parse_robot_xml(text, where)
    if robot.tag != 'robot':
        raise ConfigError(f'{where}: given <{robot.tag}>; allowed: a URDF or xacro file, which begins with <robot>')
    for tag in ('include', 'macro'):
        if robot.find(tag) is not None:
            raise ConfigError(f'{where}: <{tag}>: given in a URDF; allowed: in a xacro, as <xacro:{tag}>')
    notes: List[str] = []
    links = [_link(element, where, notes) for element in robot.findall('link')]
    joints = [_joint(element, where) for element in robot.findall('joint')]
    if not links:
        raise ConfigError(f'{where}: the robot has no link; allowed: the file of a whole robot, not of macros only')
    if len(links) > MOST_LINKS:
        raise ConfigError(f'{where}: given {len(links)} links; allowed: at most {MOST_LINKS}')
    for kind, names in (('link', [link.name for link in links]), ('joint', [joint.name for joint in joints])):
        name, count = Counter(names).most_common(1)[0] if names else ('', 0)
        if count > 1:
            raise ConfigError(f'{where}: {kind} {name!r}: given {count} times; allowed: once')
    by_name = {link.name: link for link in links}
    root = _checked_root(by_name, joints, where)
    name = _name(robot, where) if robot.get('name', '').strip() else 'robot'
    return RobotTree(name, root, by_name, {joint.name: joint for joint in joints}, robot, where, tuple(notes))


def _checked_root(links: Dict[str, Link], joints: Sequence[Joint], where: str) -> str:
    """Return the name of the one link that is above all others."""
    above: Dict[str, Joint] = {}
    for joint in joints:
        for end, name in (('parent', joint.parent), ('child', joint.child)):
            if name not in links:
                hint = did_you_mean(name, links)
                raise ConfigError(f'{where}: joint {joint.name!r}: {end}: no link is named {name!r}{hint}')
        if joint.child in above:
            pair = f'{above[joint.child].name!r} and {joint.name!r}'
            raise ConfigError(f'{where}: link {joint.child!r} is the child of two joints, {pair}; allowed: one')
        above[joint.child] = joint
    for start in links:
        chain = [start]
        while chain[-1] in above and len(chain) <= len(above):
            chain.append(above[chain[-1]].parent)
            if chain[-1] == start:
                raise ConfigError(f'{where}: the links {_listed(chain)} form a loop; allowed: a tree')
    roots = [name for name in links if name not in above]
    if len(roots) > 1:
        raise ConfigError(
            f'{where}: {len(roots)} links hang on no joint: {_listed(roots)}; allowed: one, the root of all others'
        )
    return roots[0]


def _listed(names: Sequence[str]) -> str:
    shown = ', '.join(repr(name) for name in names[:10])
    return shown if len(names) <= 10 else f'{shown} and {len(names) - 10} more'


def _name(element: ElementTree.Element, where: str) -> str:
    name = element.get('name', '')
    if not name.strip():
        raise ConfigError(f'{where}: <{element.tag}>: name: missing')
    if len(name.encode('utf-8')) > LONGEST_NAME:
        raise ConfigError(f'{where}: <{element.tag}>: name: given {name!r}; allowed: at most {LONGEST_NAME} bytes')
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
    for end, link in (('parent', parent), ('child', child)):
        if not link:
            raise ConfigError(f'{place}: {end}: missing; allowed: <{end} link="..."/>')
    if parent == child:
        raise ConfigError(f'{place}: given {parent!r} as parent and child; allowed: two links')
    axis_element, axis = element.find('axis'), np.array([1.0, 0.0, 0.0])
    if axis_element is not None and kind not in ('fixed', 'floating'):
        vector = np.array(bounded_numbers(axis_element.get('xyz', '1 0 0'), 3, f'{place}: axis xyz'))
        if np.linalg.norm(vector) < 1e-6:
            raise ConfigError(f'{place}: axis xyz: given {axis_element.get("xyz")!r}; allowed: a direction, not zero')
        axis = vector / float(np.linalg.norm(vector))
    limit = element.find('limit')
    given = {} if limit is None else limit.attrib
    spins = kind == 'continuous' or (kind == 'revolute' and _range_rad(given) >= 2.0 * math.pi)
    effort, speed = _limit(given, 'effort', place), _limit(given, 'velocity', place)
    is_mimic = element.find('mimic') is not None
    return Joint(name, kind, parent, child, _pose(element, place), axis, effort, speed, is_mimic, spins)


def _limit(given: Dict[str, str], key: str, place: str) -> Optional[float]:
    """Return a limit; None if there is none, or it is infinite."""
    if key not in given:
        return None
    try:
        value = float(given[key])
    except ValueError:
        value = math.nan
    if math.isnan(value) or value < 0:
        raise ConfigError(f'{place}: limit {key}: given {given[key]!r}; allowed: a number, not negative')
    return value if math.isfinite(value) else None


def _range_rad(limits: Dict[str, str]) -> float:
    try:
        return float(limits.get('upper', 'inf')) - float(limits.get('lower', '-inf'))
    except ValueError:
        return math.inf


def _link(element: ElementTree.Element, where: str, notes: List[str]) -> Link:
    name = _name(element, where)
    place = f'{where}: link {name!r}'
    collisions = [_shape(each, f'{place}: collision') for each in element.findall('collision')]
    if None in collisions:
        notes.append(f'link {name!r}: a <collision> without a shape or of size zero is ignored')
    inertial = _inertial(element, place)
    if inertial is None and element.find('inertial') is not None:
        notes.append(f'link {name!r}: an <inertial> without mass is ignored')
    visuals: List[Optional[Shape]] = []
    for visual in element.findall('visual'):
        try:
            visuals.append(_shape(visual, ''))
        except ConfigError:  # nothing depends on it
            continue
    friction = element.find('contact/lateral_friction')
    value = None
    if friction is not None:
        (value,) = bounded_numbers(friction.get('value'), 1, f'{place}: lateral_friction value')
        if value < 0:
            given = friction.get('value')
            raise ConfigError(f'{place}: lateral_friction value: given {given!r}; allowed: not negative')
    return Link(name, inertial, tuple(filter(None, collisions)), tuple(filter(None, visuals)), value)


def _inertial(link: ElementTree.Element, place: str) -> Optional[MassProperties]:
    inertial, mass = link.find('inertial'), link.find('inertial/mass')
    if inertial is None or mass is None:
        return None
    (mass_kg,) = bounded_numbers(mass.get('value'), 1, f'{place}: mass value')
    if mass_kg < LEAST_KG and mass_kg != 0:
        raise ConfigError(f'{place}: mass value: given {mass.get("value")!r}; allowed: at least {LEAST_KG:g} [kg]')
    element = inertial.find('inertia')
    given = {} if element is None else element.attrib
    xx, xy, xz, yy, yz, zz = (
        bounded_numbers(given.get(key, '0'), 1, f'{place}: inertia {key}')[0]
        for key in ('ixx', 'ixy', 'ixz', 'iyy', 'iyz', 'izz')
    )
    pose = _pose(inertial, f'{place}: inertial')
    turn = pose[:3, :3]
    inertia = turn @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turn.T
    return MassProperties(mass_kg, pose[:3, 3], inertia) if mass_kg > 0 else None


def _shape(element: ElementTree.Element, place: str) -> Optional[Shape]:
    """Return a shape; None if it is missing, of an unknown kind, or of size zero."""
    geometry = element.find('geometry')
    made = None if geometry is None or len(geometry) == 0 else _geometry(geometry[0], f'{place}: {geometry[0].tag}')
    return None if made is None else Shape(made, _pose(element, place))


def _geometry(element: ElementTree.Element, where: str) -> Optional[Geometry]:
    def lengths_m(key: str, count: int = 1) -> List[float]:
        sizes_m = bounded_numbers(element.get(key), count, f'{where} {key}')
        if min(sizes_m) < 0:
            raise ConfigError(f'{where} {key}: given {element.get(key)!r}; allowed: lengths greater than 0 [m]')
        return sizes_m

    if element.tag == 'mesh':
        uri = element.get('filename', '').strip()
        if not uri:
            raise ConfigError(f'{where}: filename: missing')
        x, y, z = bounded_numbers(element.get('scale', '1 1 1'), 3, f'{where} scale')
        if 0 in (x, y, z):
            raise ConfigError(f'{where} scale: given {element.get("scale")!r}; allowed: not zero')
        return Mesh(uri, (x, y, z))
    if element.tag == 'box':
        x_m, y_m, z_m = lengths_m('size', 3)
        return Box((x_m, y_m, z_m)) if min(x_m, y_m, z_m) > LEAST_M else None
    if element.tag == 'sphere':
        (radius_m,) = lengths_m('radius')
        return Sphere(radius_m) if radius_m > LEAST_M else None
    if element.tag in ('cylinder', 'capsule'):
        (radius_m,), (length_m,) = lengths_m('radius'), lengths_m('length')
        whole_m = length_m + 2 * radius_m if element.tag == 'capsule' else length_m
        return Cylinder(radius_m, whole_m) if min(radius_m, whole_m) > LEAST_M else None
    return None
