"""Drive plugins of a URDF: joints, geometry, limits.

Gazebo Classic for ROS 1, for ROS 2, Gazebo Sim and robot makers' own plugins use different tags for the same value. A
tag for `left` or `right` counts if its text is the name of a joint that carries a wheel.
"""

from __future__ import annotations

import re
from typing import AbstractSet, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple
from xml.etree import ElementTree

from diff_encoder_sim.base.plain_numbers import plain_float
from diff_encoder_sim.base.xml_values import MOST
from diff_encoder_sim.robots.robot_tree import RobotTree
from diff_encoder_sim.robots.rolling_wheels import RollingWheel, joints_above, wheel_joints

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
LEAST = 1e-6  # in SI units
_SEPARATION_TAGS = ('wheelseparation', 'wheeltrack', 'trackwidth', 'tread')
# Whole words in the name of a plugin's file.
_KINDS = (
    (SKID_STEER, 'skid( ?steer(ing)?)? drive'),
    (STEERED, 'ackermann? (drive|steering)|((tri|bi)cycle|steer(ing)?) drive'),
    (OMNIDIRECTIONAL, r'(mecanum|omni\w*|holonomic|swerve) drive'),
    (DIFFERENTIAL, 'diff ?drive|differential'),
)
_SIDES = ('left', 'right')
_Worded = Tuple[List[str], str]  # the words of a tag, and its text
_WORD = re.compile('[A-Z]+(?![a-z])|[A-Z]?[a-z]+')


class DriveTags(NamedTuple):
    """A plugin or controller that drives wheels."""

    source: str  # the plugin's file or the controller's, as the user knows it
    kind: str
    is_named: bool  # the kind follows from the name, not only from the joints
    left_joints: Tuple[str, ...]
    right_joints: Tuple[str, ...]
    separation_m: Optional[float]
    diameter_m: Optional[float]
    limits: Dict[str, float]  # keys of DriveParams, and rim_acceleration, that of the wheel's rim [m/s^2]


def drive_plugins(tree: RobotTree, wheels: Sequence[RollingWheel]) -> Tuple[DriveTags, ...]:
    """Return the plugins that name wheel joints on the left and on the right, or a steering joint.

    Plugins are included too if their file is a drive plugin of another kind than differential.
    """
    plugins = list(tree.xml.iter('plugin'))
    # Before Gazebo 1.0 a plugin was a <controller:...> of its own name.
    plugins += [child for element in tree.xml.iter('gazebo') for child in element if child.tag != 'plugin']
    carriers = wheel_joints(tree, wheels)
    above = {joint.name for wheel in wheels for joint in joints_above(tree, tree.joints[wheel.joint].parent)}
    read = (_read_plugin(plugin, tree, carriers, above) for plugin in plugins)
    return tuple(tags for tags in read if tags is not None)


def commanded_joints(tree: RobotTree, position: bool = False) -> Tuple[str, ...]:
    """Return the joints that transmissions and ros2_control move by speed or effort; or those by position."""
    names = [name for name, interfaces in _interfaces(tree) if ('position' in interfaces) == position]
    return tuple(dict.fromkeys(name for name in names if name in tree.joints))


def tag_words(element: ElementTree.Element) -> str:
    """Return a tag in lower-case letters only: leftJoint and left_joint are the same."""
    return re.sub('[^a-z]', '', _local_name(element).lower())


def positive(text: Optional[str]) -> Optional[float]:
    """Return a tag's number; None of no number, and of 0 and enormous ones, which stand for no limit."""
    try:
        return usable(plain_float(text or ''))
    except ValueError:
        return None


def usable(number: float) -> Optional[float]:
    """Return a number that a robot's size or limit can have; None of any other."""
    return float(number) if LEAST <= number <= MOST else None


def _local_name(element: ElementTree.Element) -> str:
    """Return a tag without its namespace."""
    return element.tag.rsplit('}', 1)[-1].rsplit(':', 1)[-1]


def _words(name: str) -> List[str]:
    """Return the words of a name in lower case: leftWheelTF and left_wheel_tf are the same."""
    return [word.lower() for word in _WORD.findall(re.sub('^lib', '', name.rsplit('/', 1)[-1]))]


def _read_plugin(
    plugin: ElementTree.Element, tree: RobotTree, carriers: AbstractSet[str], above: AbstractSet[str]
) -> Optional[DriveTags]:
    """Return a plugin's tags; None of one that drives nothing.

    Args:
        plugin: its element.
        tree: the robot.
        carriers: joints that carry wheels.
        above: joints between these and the root, which can steer.
    """
    elements = [(child, (child.text or '').strip()) for child in plugin.iter() if child is not plugin]
    children = [(tag_words(child), text) for child, text in elements]
    worded = [(_words(_local_name(child)), text) for child, text in elements]
    filename = plugin.get('filename') or _local_name(plugin)
    kind = _kind(filename)
    left, right = (
        _joints(worded, side, carriers) or _missing(worded, side, tree)[: kind is not None] for side in _SIDES
    )
    is_steered = any(text in above and {'steer', 'steering'}.intersection(words) for words, text in worded)
    is_other = is_steered or (kind not in (None, DIFFERENTIAL) and plugin.tag == 'plugin')
    if not ((left and right) or is_other):
        return None
    if is_steered:
        kind = STEERED
    elif kind in (None, DIFFERENTIAL) and max(len(left), len(right)) > 1:
        kind = SKID_STEER
    diameter_m = _first(children, ('wheeldiameter',))
    radius_m = _first(children, ('wheelradius',))
    if diameter_m is None and radius_m is not None:
        diameter_m = 2.0 * radius_m
    numbers = {_LIMIT_TAGS[tag]: positive(text) for tag, text in children if tag in _LIMIT_TAGS}
    limits = {key: number for key, number in numbers.items() if number is not None}
    separation_m = _first(children, _SEPARATION_TAGS)
    is_named = kind is not None or _kind(plugin.get('name', '')) == DIFFERENTIAL
    return DriveTags(filename, kind or DIFFERENTIAL, is_named, left, right, separation_m, diameter_m, limits)


def _joints(worded: Sequence[_Worded], side: str, carriers: AbstractSet[str]) -> Tuple[str, ...]:
    """Return the wheel joints that a plugin names on one side: one for each tag, or a list as in XML or by commas."""
    texts = [text for words, text in worded if side in words]
    names = (name for text in texts for name in (text, *re.split(r'[\s,]+', text)))
    return tuple(dict.fromkeys(name for name in names if name in carriers))


def _missing(worded: Sequence[_Worded], side: str, tree: RobotTree) -> Tuple[str, ...]:
    """Return the joints of one side that the robot does not have."""
    named = (text for words, text in worded if {side, 'joint'} <= {*words} and words[-1] in ('joint', 'name'))
    return tuple(text for text in named if text not in tree.joints)


def _kind(name: str) -> Optional[str]:
    words = ' '.join(_words(name))
    return next((kind for kind, pattern in _KINDS if re.search(rf'\b({pattern})\b', words)), None)


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
