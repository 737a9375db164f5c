"""What a URDF's simulator plugins say of the drive: joints, geometry, limits.

Gazebo Classic for ROS 1, for ROS 2, Gazebo Sim and robot makers' own plugins name the same by different tags, so a tag
is recognised by the words in it, not by its plugin.
"""

from __future__ import annotations

import math
import re
from typing import Dict, Iterator, List, NamedTuple, Optional, Tuple
from xml.etree import ElementTree

from diff_encoder_sim.robots.robot_tree import RobotTree

DIFFERENTIAL, SKID_STEER, STEERED, OMNIDIRECTIONAL = 'differential', 'skid-steer', 'steered', 'omnidirectional'

# Limits under the keys of DriveParams, by the tags that give them in its units.
_LIMIT_TAGS = {
    'wheeltorque': 'wheel_torque',
    'maxwheeltorque': 'wheel_torque',
    'torque': 'wheel_torque',
    'maxlinearvelocity': 'max_linear_speed',
    'maxangularvelocity': 'max_angular_speed',
    'maxlinearacceleration': 'max_linear_acceleration',
    'maxangularacceleration': 'max_angular_acceleration',
    'wheelacceleration': 'rim_acceleration',
    'maxwheelacceleration': 'rim_acceleration',
}
_SEPARATION_TAGS = ('wheelseparation', 'wheeltrack', 'trackwidth', 'tread')
_KIND_WORDS = (
    (SKID_STEER, 'skid'),
    (STEERED, 'ackermann|tricycle|steer'),
    (OMNIDIRECTIONAL, 'planar_?move|force_based_move|mecanum|omni|holonomic'),
    (DIFFERENTIAL, 'diff[-_]?drive|differential'),
)


class DriveTags(NamedTuple):
    """A plugin or controller that drives wheels."""

    source: str  # the plugin's file or the controller's, as the user knows it
    kind: str
    left_joints: Tuple[str, ...]
    right_joints: Tuple[str, ...]
    separation_m: Optional[float]
    diameter_m: Optional[float]
    limits: Dict[str, float]  # keys of DriveParams, and rim_acceleration, that of the wheel's rim [m/s^2]


def drive_plugins(tree: RobotTree) -> Tuple[DriveTags, ...]:
    """Return the plugins that name a left and a right joint, or whose name says what they drive."""
    plugins = list(tree.xml.iter('plugin'))
    # Before Gazebo 1.0 a plugin was a <controller:...> of its own name.
    plugins += [child for element in tree.xml.iter('gazebo') for child in element if child.tag != 'plugin']
    read = (_read_plugin(plugin) for plugin in plugins)
    return tuple(tags for tags in read if tags is not None)


def commanded_joints(tree: RobotTree, position: bool = False) -> Tuple[str, ...]:
    """Return the joints that transmissions and ros2_control move by speed or effort; or those by position."""
    names = [name for name, interfaces in _interfaces(tree) if ('position' in interfaces) == position]
    return tuple(dict.fromkeys(name for name in names if name in tree.joints))


def tag_words(element: ElementTree.Element) -> str:
    """Return a tag in lower-case letters only: leftJoint and left_joint are the same."""
    return re.sub('[^a-z]', '', _local_name(element).lower())


def positive(text: Optional[str]) -> Optional[float]:
    """Return a tag's number; None where it is none, or not above zero: plugins take 0 for no limit."""
    try:
        number = float(text or '')
    except ValueError:
        return None
    return number if 0.0 < number < math.inf else None


def _local_name(element: ElementTree.Element) -> str:
    """Return a tag without its namespace."""
    return element.tag.rsplit('}', 1)[-1].rsplit(':', 1)[-1]


def _read_plugin(plugin: ElementTree.Element) -> Optional[DriveTags]:
    children = [(tag_words(child), (child.text or '').strip()) for child in plugin.iter() if child is not plugin]
    filename = plugin.get('filename') or _local_name(plugin)
    left, right = _joints(children, 'left'), _joints(children, 'right')
    kind = _kind(f'{filename} {plugin.get("name")}', children, left)
    if not (left and right) and (kind not in (STEERED, OMNIDIRECTIONAL) or plugin.tag != 'plugin'):
        return None
    diameter_m = _first(children, ('wheeldiameter',))
    radius_m = _first(children, ('wheelradius',))
    if diameter_m is None and radius_m is not None:
        diameter_m = 2.0 * radius_m
    numbers = {_LIMIT_TAGS[tag]: positive(text) for tag, text in children if tag in _LIMIT_TAGS}
    limits = {key: number for key, number in numbers.items() if number is not None}
    return DriveTags(
        filename, kind or DIFFERENTIAL, left, right, _first(children, _SEPARATION_TAGS), diameter_m, limits
    )


def _joints(children: List[Tuple[str, str]], side: str) -> Tuple[str, ...]:
    """Return the joints that a plugin drives on one side."""
    named = [text for tag, text in children if side in tag and re.search('joint|wheel', tag) and 'steer' not in tag]
    # A number is a size of that side's wheel; a list is separated as in XML or by commas.
    words = [word for text in named if positive(text) is None for word in re.split(r'[\s,]+', text) if word]
    return tuple(dict.fromkeys(words))


def _kind(names: str, children: List[Tuple[str, str]], left: Tuple[str, ...]) -> Optional[str]:
    found = next((kind for kind, words in _KIND_WORDS if re.search(words, names, re.IGNORECASE)), None)
    if any('steeringjoint' in tag for tag, _ in children):
        return STEERED
    return SKID_STEER if len(left) > 1 and found in (None, DIFFERENTIAL) else found


def _first(children: List[Tuple[str, str]], tags: Tuple[str, ...]) -> Optional[float]:
    return next((positive(text) for tag, text in children if tag in tags), None)


def _interfaces(tree: RobotTree) -> Iterator[Tuple[str, str]]:
    """Yield each commanded joint's name with the kinds of its interfaces, in lower case."""
    for transmission in tree.xml.iter('transmission'):
        kinds = ' '.join(
            element.text or '' for element in transmission.iter() if tag_words(element) == 'hardwareinterface'
        )
        for joint in transmission.findall('joint'):
            yield joint.get('name', ''), kinds.lower()
    for control in tree.xml.iter('ros2_control'):
        for joint in control.findall('joint'):
            kinds = ' '.join(command.get('name', '') for command in joint.findall('command_interface'))
            if kinds:
                yield joint.get('name', ''), kinds.lower()
