"""Reads URDF text into a tree of links and joints; whatever is wrong is one line with file and element."""

from __future__ import annotations

from collections import Counter
from typing import Dict, List, Sequence
from xml.etree import ElementTree

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.typed_params import did_you_mean
from diff_encoder_sim.robots.robot_tree import Joint, Link, RobotTree
from diff_encoder_sim.robots.robot_xml import parse_robot_xml
from diff_encoder_sim.robots.urdf_joints import parse_joint
from diff_encoder_sim.robots.urdf_links import parse_link
from diff_encoder_sim.robots.urdf_values import named

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
        raise ConfigError(f'{where}: the robot has no link')
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
