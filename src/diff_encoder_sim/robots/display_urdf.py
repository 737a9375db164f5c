"""A robot's URDF for robot_state_publisher, which publishes the frames of its links."""

from __future__ import annotations

from typing import Collection
from xml.etree import ElementTree

from diff_encoder_sim.robots.robot_source import RobotSource
from diff_encoder_sim.robots.xacro_expansion import expansion

# Of a xacro that can hang the root link's inertia on a link of its own.
ROOT_INERTIA = 'root_inertia'


def without_root_inertia(source: RobotSource) -> RobotSource:
    """Return the source with the xacro's own argument for it, where it has one."""
    if ROOT_INERTIA not in expansion(source).declared or ROOT_INERTIA in dict(source.arguments):
        return source
    return source._replace(arguments=(*source.arguments, (ROOT_INERTIA, 'false')))


def display_urdf(source: RobotSource, moving: Collection[str]) -> str:
    """Return the URDF with all joints fixed but those that are published on /joint_states, named by `moving`.

    A link below a joint without a state has no frame: a caster's, a laser's on a mast that can be lifted. The root link
    has no inertia, of which robot_state_publisher warns.

    Raises:
        ConfigError: the file cannot be read or expanded.
    """
    urdf = expansion(without_root_inertia(source)).urdf
    robot = ElementTree.fromstring(urdf.strip())
    still = [
        joint for joint in robot.findall('joint') if joint.get('type') != 'fixed' and joint.get('name') not in moving
    ]
    for joint in still:
        joint.set('type', 'fixed')
        for tag in ('mimic', 'limit'):
            for element in joint.findall(tag):
                joint.remove(element)
    is_changed = _remove_root_inertia(robot) or bool(still)
    return ElementTree.tostring(robot, encoding='unicode') if is_changed else urdf


def _remove_root_inertia(robot: ElementTree.Element) -> bool:
    children = {child.get('link') for child in robot.findall('joint/child')}
    for link in robot.findall('link'):
        inertial = link.find('inertial')
        if link.get('name') not in children and inertial is not None:
            link.remove(inertial)
            return True
    return False
