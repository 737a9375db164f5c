"""The robot's xacro or URDF file, read once for the physics, the controller and the nodes."""

from __future__ import annotations

import functools
import re
from pathlib import Path
from typing import Dict, Mapping, NamedTuple, Tuple, Union
from xml.etree import ElementTree

import numpy as np
import xacro

from diff_encoder_sim.base.errors import ConfigError, in_one_line
from diff_encoder_sim.base.typed_params import did_you_mean
from diff_encoder_sim.base.xml_values import joint_link, joint_origin, parse_lengths, rotation_from_rpy

# Signs that a xacro file depends on more than its own text and arguments: other files, the environment.
_DEPENDS_ON_OTHERS = re.compile(rb'include|load_yaml|\$\((?!arg\b)')


class RobotModel(NamedTuple):
    """A differential-drive robot as its URDF describes it."""

    name: str
    urdf: str  # the XML, xacro expanded
    left_joint: str
    right_joint: str
    left_wheel_radius_m: float
    right_wheel_radius_m: float
    wheel_separation_m: float  # between the wheels' contact points

    def link_pose_in_root(self, link_name: str) -> np.ndarray:
        """Return the (4, 4) homogeneous pose of a link's frame in the root link, joints at zero.

        Raises:
            ConfigError: the robot has no such link.
        """
        root = ElementTree.fromstring(self.urdf)
        joints = {joint.get('name', ''): joint for joint in root.findall('joint')}
        for name, joint in joints.items():
            if joint_link(joint, 'child') == link_name:
                return _pose_in_root(joints, name, f'robot {self.name!r}')
        links = [link.get('name', '') for link in root.findall('link')]
        if link_name in links:
            return np.eye(4)  # the root itself
        raise ConfigError(f'robot {self.name!r}: link {link_name!r} is missing; it has {", ".join(links)}')


def load_robot(
    path: Union[str, Path], left_joint: str, right_joint: str, xacro_arguments: Mapping[str, str]
) -> RobotModel:
    """Read a robot whose two driven wheels turn about their y axis.

    Args:
        path: a .xacro file, or a plain URDF (then `xacro_arguments` have no effect).
        left_joint: name of the left wheel's joint.
        right_joint: name of the right wheel's joint.
        xacro_arguments: values of the file's xacro:arg.

    Raises:
        ConfigError: the file cannot be read, or has no such wheels.
    """
    urdf = expand_xacro(path, xacro_arguments)
    root = ElementTree.fromstring(urdf)
    joints = {joint.get('name', ''): joint for joint in root.findall('joint')}
    separation_m = _wheel_separation_m(joints, left_joint, right_joint, path)
    left_m, right_m = (_wheel_radius_m(root, joints[name], path) for name in (left_joint, right_joint))
    return RobotModel(root.get('name', 'robot'), urdf, left_joint, right_joint, left_m, right_m, separation_m)


def expand_xacro(path: Union[str, Path], arguments: Mapping[str, str]) -> str:
    """Return the URDF text of a xacro (or plain URDF) file.

    Raises:
        ConfigError: the file cannot be read or is not a robot.
    """
    if not Path(path).is_file():
        raise ConfigError(f'{path}: no such robot file; allowed: a .xacro or .urdf file')
    content = Path(path).read_bytes()
    expand = _expand if _DEPENDS_ON_OTHERS.search(content) else _expand_once
    return expand(str(path), content, tuple(sorted(arguments.items())))


def _expand(path: str, content: bytes, arguments: Tuple[Tuple[str, str], ...]) -> str:
    """Expand a file; its `content` is an argument so that the cache notices an edited file."""
    try:
        document = xacro.process_file(path, mappings=dict(arguments))
    except Exception as error:  # xacro lets XML, expression and file errors of many types through
        raise ConfigError(f'{path}: not a valid xacro or URDF file: {in_one_line(error)}') from None
    if document.documentElement.tagName != 'robot':
        raise ConfigError(f'{path}: given <{document.documentElement.tagName}>; allowed: <robot>')
    return str(document.toprettyxml(indent='  '))


# A campaign loads the same few robots in each of its trials; xacro takes 40 ms for one.
_expand_once = functools.lru_cache(maxsize=32)(_expand)


def _pose_in_root(joints: Dict[str, ElementTree.Element], joint_name: str, path: Union[str, Path]) -> np.ndarray:
    """Return the (4, 4) homogeneous pose of a joint in the root link, all joints at zero."""
    if joint_name not in joints:
        raise ConfigError(
            f'{path}: joint {joint_name!r} is missing; the file has '
            f'{", ".join(joints) or "no joint"}{did_you_mean(joint_name, joints)}'
        )
    joint_above = {joint_link(joint, 'child'): joint for joint in joints.values()}
    joint = joints[joint_name]
    pose = np.eye(4)
    for _ in joints:
        pose = _origin(joint, path) @ pose
        parent = joint_link(joint, 'parent')
        if parent not in joint_above:
            return pose
        joint = joint_above[parent]
    raise ConfigError(f'{path}: the links above joint {joint_name!r} form a loop; allowed: a tree')


def _origin(joint: ElementTree.Element, source: Union[str, Path]) -> np.ndarray:
    """Return the (4, 4) homogeneous pose of a joint's frame in its parent link."""
    xyz_m, rpy_rad = joint_origin(joint, f'{source}: ')
    pose = np.eye(4)
    pose[:3, :3] = rotation_from_rpy(*rpy_rad)
    pose[:3, 3] = xyz_m
    return pose


def _wheel_separation_m(
    joints: Dict[str, ElementTree.Element], left_joint: str, right_joint: str, path: Union[str, Path]
) -> float:
    """Return the distance [m] between the wheels' centres along the root's y axis."""
    left_m = _pose_in_root(joints, left_joint, path)[1, 3]
    right_m = _pose_in_root(joints, right_joint, path)[1, 3]
    if left_m <= right_m:
        raise ConfigError(
            f'{path}: {left_joint!r} is at y = {left_m:.3f} m and {right_joint!r} at {right_m:.3f} m; '
            'allowed: the left wheel left of the right one'
        )
    return float(left_m - right_m)


def _wheel_radius_m(root: ElementTree.Element, joint: ElementTree.Element, path: Union[str, Path]) -> float:
    """Return the rolling radius [m]: that of the wheel's collision sphere or cylinder."""
    link_name = joint_link(joint, 'child')
    for shape in ('sphere', 'cylinder'):
        element = root.find(f"link[@name='{link_name}']/collision/geometry/{shape}")
        if element is not None:
            return parse_lengths(element.get('radius'), 1, f'{path}: wheel {link_name!r} radius')[0]
    raise ConfigError(f'{path}: wheel {link_name!r} has no rolling shape; allowed: a collision sphere (or cylinder)')
