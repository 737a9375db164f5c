"""Reads URDF text into a tree of links and joints."""

from __future__ import annotations

import codecs
import math
import re
from collections import Counter
from pathlib import Path
from typing import Dict, Iterator, List, Optional, Sequence, Union
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
    Inertial,
    Joint,
    Link,
    Mesh,
    RobotTree,
    Shape,
    Sphere,
)

LONGEST_NAME = 255


def named(element: ElementTree.Element, where: str) -> str:
    """Return an element's name.

    Raises:
        ConfigError: it has none, or one that PyBullet has no room for.
    """
    name = element.get('name', '')
    if not name.strip():
        raise ConfigError(f'{where}: <{element.tag}>: name: missing')
    if len(name.encode('utf-8')) > LONGEST_NAME:
        raise ConfigError(f'{where}: <{element.tag}>: name: given {name!r}; allowed: at most {LONGEST_NAME} bytes')
    return name


def parse_pose(parent: ElementTree.Element, where: str) -> np.ndarray:
    """Return the (4, 4) pose of an element's <origin>, [m] and [rad]; that of the parent frame where it has none.

    Raises:
        ConfigError: xyz or rpy are not three numbers.
    """
    origin = parent.find('origin')
    pose = np.eye(4)
    if origin is not None:
        pose[:3, 3] = bounded_numbers(origin.get('xyz', '0 0 0'), 3, f'{where}: origin xyz')
        pose[:3, :3] = rotation_from_rpy(*bounded_numbers(origin.get('rpy', '0 0 0'), 3, f'{where}: origin rpy'))
    return pose


MOST_BYTES = 20_000_000

_DECLARATION = re.compile(r'<\?xml\s.*?\?>', re.DOTALL)
_ENCODING = re.compile(rb'<\?xml\s[^>]*encoding\s*=\s*["\']([\w.-]+)')


def read_robot_text(path: Union[str, Path]) -> str:
    """Return the text of an XML file without its declaration, lines where they were.

    A byte order mark, blank lines or comments before the declaration do no harm then, nor do stray bytes in a comment.

    Raises:
        ConfigError: the file is missing, too big, or not text.
    """
    text = _decoded(_content(Path(path)), path).lstrip('\ufeff')
    return _DECLARATION.sub(lambda declaration: '\n' * declaration.group().count('\n'), text, count=1)


def parse_robot_xml(text: str, where: Union[str, Path]) -> ElementTree.Element:
    """Return the root element; prefixes of tags are dropped, declared or not, as URDF has one vocabulary.

    Raises:
        ConfigError: the text is not XML, or declares entities.
    """
    builder = ElementTree.TreeBuilder()
    parser = expat.ParserCreate()
    parser.buffer_text = True
    parser.EntityDeclHandler = lambda name, *_: _refuse_entity(name, where)
    parser.StartElementHandler = lambda tag, attributes: builder.start(tag.rpartition(':')[2], attributes)
    parser.EndElementHandler = lambda tag: builder.end(tag.rpartition(':')[2])
    parser.CharacterDataHandler = builder.data
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        raise ConfigError(f'{where}, line {error.lineno}: not well-formed XML: {reason}') from None
    except UnicodeEncodeError:
        raise ConfigError(f'{where}: not well-formed XML: a character that no text has') from None
    return builder.close()


def _refuse_entity(name: str, where: Union[str, Path]) -> None:
    raise ConfigError(f'{where}: declares the XML entity {name!r}; allowed: no entities')


def _content(path: Path) -> bytes:
    if path.is_dir():
        raise ConfigError(f'{path}: a folder; allowed: a .xacro or .urdf file')
    if not path.is_file():
        raise ConfigError(f'{path}: no such robot file; allowed: a .xacro or .urdf file')
    try:
        with path.open('rb') as file:
            content = file.read(MOST_BYTES + 1)
    except OSError as error:
        raise ConfigError(f'{path}: cannot be read: {error.strerror}') from None
    if len(content) > MOST_BYTES:
        raise ConfigError(f'{path}: too big; allowed: at most {MOST_BYTES // 10**6} MB')
    return content


def _decoded(content: bytes, path: Union[str, Path]) -> str:
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return content.decode('utf-16', errors='replace')
    if b'\0' in content:
        raise ConfigError(f'{path}: a binary file; allowed: a xacro or URDF file')
    declared = _ENCODING.search(content, 0, 1000)
    name = declared[1].decode() if declared else 'utf-8'
    try:
        return content.decode(name, errors='replace')
    except (LookupError, UnicodeError):  # unknown, or of Python's own kinds, such as idna
        raise ConfigError(f'{path}: encoding: given {name!r}; allowed: utf-8, iso-8859-1 and the like') from None


JOINT_KINDS = ('fixed', 'continuous', 'revolute', 'prismatic', 'floating', 'planar')
_WITHOUT_AXIS = ('fixed', 'floating')


def parse_joint(element: ElementTree.Element, where: str) -> Joint:
    """Return a joint.

    Raises:
        ConfigError: it has no name, parent or child, an unknown type, or bad numbers.
    """
    name = named(element, where)
    place = f'{where}: joint {name!r}'
    kind, parent, child = element.get('type', ''), joint_link(element, 'parent'), joint_link(element, 'child')
    if kind not in JOINT_KINDS:
        raise ConfigError(
            f'{place}: type: given {kind!r}; allowed: {", ".join(JOINT_KINDS)}{did_you_mean(kind, JOINT_KINDS)}'
        )
    for end, link in (('parent', parent), ('child', child)):
        if not link:
            raise ConfigError(f'{place}: {end}: missing; allowed: <{end} link="..."/>')
    if parent == child:
        raise ConfigError(f'{place}: given {parent!r} as parent and child; allowed: two links')
    pose, axis = parse_pose(element, place), _axis(element, kind, place)
    effort, speed = _limit(element, 'effort', place), _limit(element, 'velocity', place)
    return Joint(name, kind, parent, child, pose, axis, effort, speed, element.find('mimic') is not None)


def _axis(joint: ElementTree.Element, kind: str, place: str) -> np.ndarray:
    """Return the (3,) unit axis; x where none is given or needed."""
    axis = joint.find('axis')
    if axis is None or kind in _WITHOUT_AXIS:
        return np.array([1.0, 0.0, 0.0])
    vector = np.array(bounded_numbers(axis.get('xyz', '1 0 0'), 3, f'{place}: axis xyz'))
    length = float(np.linalg.norm(vector))
    if length < 1e-6:
        raise ConfigError(f'{place}: axis xyz: given {axis.get("xyz")!r}; allowed: a direction, not zero')
    return vector / length


def _limit(joint: ElementTree.Element, key: str, place: str) -> Optional[float]:
    """Return a limit; None where there is none, or it is infinite."""
    limit = joint.find('limit')
    text = None if limit is None else limit.get(key)
    if text is None:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if math.isnan(value) or value < 0:
        raise ConfigError(f'{place}: limit {key}: given {text!r}; allowed: a number, not negative')
    return value if math.isfinite(value) else None


LEAST_KG = 1e-9  # of a link that has a mass
LEAST_M = 1e-9  # of a shape; a smaller one is of size zero


def parse_link(element: ElementTree.Element, where: str, notes: List[str]) -> Link:
    """Return a link; what is ignored of it is added to `notes`.

    Raises:
        ConfigError: it has no name, or bad numbers in its inertial or a collision.
    """
    name = named(element, where)
    place = f'{where}: link {name!r}'
    collisions = [_shape(each, f'{place}: collision') for each in element.findall('collision')]
    if None in collisions:
        notes.append(f'link {name!r}: a <collision> without a shape or of size zero is ignored')
    inertial = _inertial(element, place)
    if inertial is None and element.find('inertial') is not None:
        notes.append(f'link {name!r}: an <inertial> without mass is ignored')
    shapes = tuple(shape for shape in collisions if shape is not None)
    return Link(name, inertial, shapes, tuple(_visuals(element)), _friction(element, place))


def _inertial(link: ElementTree.Element, place: str) -> Optional[Inertial]:
    inertial, mass = link.find('inertial'), link.find('inertial/mass')
    if inertial is None or mass is None:
        return None
    (mass_kg,) = bounded_numbers(mass.get('value'), 1, f'{place}: mass value')
    if mass_kg < LEAST_KG and mass_kg != 0:
        raise ConfigError(f'{place}: mass value: given {mass.get("value")!r}; allowed: at least {LEAST_KG:g} [kg]')
    pose = parse_pose(inertial, f'{place}: inertial')
    rotation = pose[:3, :3]
    inertia = rotation @ _inertia(inertial.find('inertia'), place) @ rotation.T
    return Inertial(mass_kg, pose[:3, 3], inertia) if mass_kg > 0 else None


def _inertia(inertia: Optional[ElementTree.Element], place: str) -> np.ndarray:
    """Return the (3, 3) inertia [kg m^2] along the inertial's own axes; 0 where a number is missing."""
    keys = ('ixx', 'ixy', 'ixz', 'iyy', 'iyz', 'izz')
    given = {} if inertia is None else inertia.attrib
    xx, xy, xz, yy, yz, zz = (bounded_numbers(given.get(key, '0'), 1, f'{place}: inertia {key}')[0] for key in keys)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _visuals(link: ElementTree.Element) -> Iterator[Shape]:
    """Yield the visual shapes that are good; nothing depends on the others."""
    for visual in link.findall('visual'):
        try:
            shape = _shape(visual, '')
        except ConfigError:
            continue
        if shape is not None:
            yield shape


def _shape(element: ElementTree.Element, place: str) -> Optional[Shape]:
    """Return a shape; None where it is missing, of an unknown kind, or of size zero."""
    geometry = element.find('geometry')
    made = next((_geometry(each, place) for each in ([] if geometry is None else geometry)), None)
    return None if made is None else Shape(made, parse_pose(element, place))


def _geometry(element: ElementTree.Element, place: str) -> Optional[Geometry]:
    where = f'{place}: {element.tag}'
    if element.tag == 'mesh':
        return _mesh(element, where)
    if element.tag == 'box':
        x_m, y_m, z_m = sizes_m = _sizes_m(element, 'size', 3, where)
        return Box((x_m, y_m, z_m)) if min(sizes_m) > LEAST_M else None
    if element.tag == 'sphere':
        (radius_m,) = _sizes_m(element, 'radius', 1, where)
        return Sphere(radius_m) if radius_m > LEAST_M else None
    if element.tag in ('cylinder', 'capsule'):
        (radius_m,), (length_m,) = (_sizes_m(element, key, 1, where) for key in ('radius', 'length'))
        whole_m = length_m + 2 * radius_m if element.tag == 'capsule' else length_m
        return Cylinder(radius_m, whole_m) if min(radius_m, whole_m) > LEAST_M else None
    return None


def _mesh(element: ElementTree.Element, where: str) -> Mesh:
    uri = element.get('filename', '').strip()
    if not uri:
        raise ConfigError(f'{where}: filename: missing')
    x, y, z = bounded_numbers(element.get('scale', '1 1 1'), 3, f'{where} scale')
    if 0 in (x, y, z):
        raise ConfigError(f'{where} scale: given {element.get("scale")!r}; allowed: not zero')
    return Mesh(uri, (x, y, z))


def _sizes_m(element: ElementTree.Element, key: str, count: int, where: str) -> List[float]:
    sizes_m = bounded_numbers(element.get(key), count, f'{where} {key}')
    if min(sizes_m) < 0:
        raise ConfigError(f'{where} {key}: given {element.get(key)!r}; allowed: lengths greater than 0 [m]')
    return sizes_m


def _friction(link: ElementTree.Element, place: str) -> Optional[float]:
    friction = link.find('contact/lateral_friction')
    if friction is None:
        return None
    (value,) = bounded_numbers(friction.get('value'), 1, f'{place}: lateral_friction value')
    if value < 0:
        raise ConfigError(f'{place}: lateral_friction value: given {friction.get("value")!r}; allowed: not negative')
    return value


MOST_LINKS = 1000

_OTHER_FORMATS = {
    'sdf': 'an SDF file (of Gazebo)',
    'gazebo': 'an SDF file (of Gazebo)',
    'mujoco': 'an MJCF file (of MuJoCo)',
    'launch': 'a launch file',
    'package': 'a package.xml',
    'COLLADA': 'a mesh (COLLADA)',
}
_XACRO_TAGS = ('include', 'macro')


def parse_urdf(text: str, where: str) -> RobotTree:
    """Return the tree of a robot.

    Args:
        text: URDF, xacro expanded.
        where: the robot's file, which begins each error.

    Raises:
        ConfigError: the text is not the URDF of one tree of links.
    """
    robot = parse_robot_xml(text, where)
    _check_format(robot, where)
    notes: List[str] = []
    links = [parse_link(element, where, notes) for element in robot.findall('link')]
    joints = [parse_joint(element, where) for element in robot.findall('joint')]
    _check_names('link', [link.name for link in links], where)
    _check_names('joint', [joint.name for joint in joints], where)
    by_name = {link.name: link for link in links}
    root = _checked_root(by_name, joints, where)
    name = named(robot, where) if robot.get('name', '').strip() else 'robot'
    return RobotTree(name, root, by_name, {joint.name: joint for joint in joints}, robot, where, tuple(notes))


def _check_format(robot: ElementTree.Element, where: str) -> None:
    if robot.tag != 'robot':
        kind = _OTHER_FORMATS.get(robot.tag, f'<{robot.tag}>')
        raise ConfigError(f'{where}: given {kind}; allowed: a URDF or xacro file, which begins with <robot>')
    for tag in _XACRO_TAGS:
        if robot.find(tag) is not None:
            raise ConfigError(f'{where}: <{tag}>: given in a URDF; allowed: in a xacro, as <xacro:{tag}>')


def _check_names(kind: str, names: Sequence[str], where: str) -> None:
    if not names and kind == 'link':
        raise ConfigError(f'{where}: the robot has no link; allowed: the file of a whole robot, not of macros only')
    if len(names) > MOST_LINKS:
        raise ConfigError(f'{where}: given {len(names)} {kind}s; allowed: at most {MOST_LINKS}')
    name, count = Counter(names).most_common(1)[0] if names else ('', 0)
    if count > 1:
        raise ConfigError(f'{where}: {kind} {name!r}: given {count} times; allowed: once')


def _checked_root(links: Dict[str, Link], joints: Sequence[Joint], where: str) -> str:
    """Return the name of the one link that all others hang below."""
    above: Dict[str, Joint] = {}
    for joint in joints:
        for end, name in (('parent', joint.parent), ('child', joint.child)):
            if name not in links:
                raise ConfigError(
                    f'{where}: joint {joint.name!r}: {end}: no link is named {name!r}{did_you_mean(name, links)}'
                )
        if joint.child in above:
            raise ConfigError(
                f'{where}: link {joint.child!r} is the child of two joints, '
                f'{above[joint.child].name!r} and {joint.name!r}; allowed: one'
            )
        above[joint.child] = joint
    for name in links:
        _check_no_loop(name, above, where)
    roots = [name for name in links if name not in above]
    if len(roots) > 1:
        raise ConfigError(
            f'{where}: {len(roots)} links hang on no joint: {_listed(roots)}; allowed: one, the root of all others'
        )
    return roots[0]


def _check_no_loop(name: str, above: Dict[str, Joint], where: str) -> None:
    chain = [name]
    while chain[-1] in above and len(chain) <= len(above):
        chain.append(above[chain[-1]].parent)
        if chain[-1] == name:
            raise ConfigError(f'{where}: the links {_listed(chain)} form a loop; allowed: a tree')


def _listed(names: Sequence[str]) -> str:
    shown = ', '.join(repr(name) for name in names[:10])
    return shown if len(names) <= 10 else f'{shown} and {len(names) - 10} more'
