"""The tags of a URDF that name driven wheels: of Gazebo's plugins and of transmissions."""

from __future__ import annotations

import re
from typing import AbstractSet, Dict, List, NamedTuple, Optional, Sequence, Tuple
from xml.etree import ElementTree

from diff_encoder_sim.base.xml_values import MOST
from diff_encoder_sim.robots.description import DrivenWheel, RobotTree

DIFFERENTIAL, SKID_STEER, STEERED, OMNIDIRECTIONAL = 'differential', 'skid-steer', 'steered', 'omnidirectional'
# Whole words in the name of a plugin's file.
_KINDS = (
    (SKID_STEER, 'skid( ?steer(ing)?)? drive'),
    (STEERED, 'ackermann? (drive|steering)|((tri|bi)cycle|steer(ing)?) drive'),
    (OMNIDIRECTIONAL, r'(mecanum|omni\w*|holonomic|swerve) drive'),
    (DIFFERENTIAL, 'diff ?drive|differential'),
)
_WORD = re.compile('[A-Z]+(?![a-z])|[A-Z]?[a-z]+')

# Quantities by the tags that give them, in lower-case letters only; limits under the keys of DriveParams.
_TAGS = {
    'wheelseparation': 'separation',
    'wheeltrack': 'separation',
    'trackwidth': 'separation',
    'tread': 'separation',
    'wheeldiameter': 'diameter',
    'wheelradius': 'radius',
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
LEAST = 1e-6  # of a size or limit, in SI units


class DriveTags(NamedTuple):
    """A plugin that drives wheels."""

    source: str  # the plugin's file
    kind: str
    is_named: bool  # the kind follows from the name, not only from the joints
    left_joints: Tuple[str, ...]
    right_joints: Tuple[str, ...]
    separation_m: Optional[float]
    diameter_m: Optional[float]
    limits: Dict[str, float]  # keys of DriveParams, and rim_acceleration, that of the wheel's rim [m/s^2]


def find_drive_tags(
    tree: RobotTree, wheels: Sequence[DrivenWheel], carriers: AbstractSet[str]
) -> Tuple[DriveTags, ...]:
    """Return the plugins that name wheel joints on the left and on the right, or a steering joint.

    Plugins are included too if their file is a drive plugin of another kind than differential. `carriers` are the
    joints that can drive the robot.
    """
    above = {joint.name for wheel in wheels for joint in tree.joints_above(tree.joints[wheel.joint].parent)}
    found = [_plugin(plugin, tree, carriers, above) for plugin in tree.xml.iter('plugin')]
    return tuple(tags for tags in found if tags is not None)


def commanded_joints(tree: RobotTree, position: bool = False) -> Tuple[str, ...]:
    """Return the joints that transmissions and ros2_control move by speed or effort; or those by position."""
    interfaces: List[Tuple[str, str]] = []  # joint, kinds
    for transmission in tree.xml.iter('transmission'):
        kinds = ' '.join(each.text or '' for each in transmission.iter() if tag_letters(each) == 'hardwareinterface')
        interfaces += [(joint.get('name', ''), kinds) for joint in transmission.findall('joint')]
    for joint in tree.xml.iterfind('.//ros2_control/joint'):
        kinds = ' '.join(command.get('name', '') for command in joint.findall('command_interface'))
        interfaces += [(joint.get('name', ''), kinds)] if kinds else []
    names = [name for name, kinds in interfaces if name in tree.joints and ('position' in kinds.lower()) == position]
    return tuple(dict.fromkeys(names))


def tag_letters(element: ElementTree.Element) -> str:
    """Return a tag in lower-case letters only: leftJoint and left_joint are the same."""
    return re.sub('[^a-z]', '', element.tag.lower())


def _words(name: str) -> List[str]:
    """Return the words of a name in lower case: leftWheelTF and left_wheel_tf are the same."""
    return [word.lower() for word in _WORD.findall(re.sub('^lib', '', name.rsplit('/', 1)[-1]))]


def _kind(name: str) -> Optional[str]:
    words = ' '.join(_words(name))
    return next((kind for kind, pattern in _KINDS if re.search(rf'\b({pattern})\b', words)), None)


def _plugin(
    plugin: ElementTree.Element, tree: RobotTree, carriers: AbstractSet[str], above: AbstractSet[str]
) -> Optional[DriveTags]:
    """Return the tags of a plugin; None if it drives nothing. Joints `above` wheels can steer."""
    children = [(child, (child.text or '').strip()) for child in plugin.iter() if child is not plugin]
    worded = [(_words(child.tag), text) for child, text in children]
    filename = plugin.get('filename', '')
    kind = _kind(filename)
    sides: List[Tuple[str, ...]] = []
    for side in ('left', 'right'):
        # Wheel joints: one for each tag, or a list as in XML or by commas; of a drive plugin else a missing joint.
        texts = [text for words, text in worded if side in words]
        names = [name for text in texts for name in (text, *re.split(r'[\s,]+', text)) if name in carriers]
        missing = (
            text
            for words, text in worded
            if {side, 'joint'} <= {*words} and words[-1] in ('joint', 'name') and text not in tree.joints
        )
        sides.append(tuple(dict.fromkeys(names)) or tuple(missing)[: kind is not None])
    left, right = sides
    is_steered = any(text in above and {'steer', 'steering'}.intersection(words) for words, text in worded)
    if not ((left and right) or is_steered or kind not in (None, DIFFERENTIAL)):
        return None
    if is_steered:
        kind = STEERED
    elif kind in (None, DIFFERENTIAL) and max(len(left), len(right)) > 1:
        kind = SKID_STEER
    sizes: Dict[str, float] = {}  # of several the first
    limits: Dict[str, float] = {}  # of several the last
    for child, text in children:
        key, number = _TAGS.get(tag_letters(child), ''), _number(text)
        if key in ('separation', 'diameter', 'radius') and number is not None:
            sizes.setdefault(key, number)
        elif key and number is not None:
            limits[key] = number
    diameter_m = sizes.get('diameter', 2.0 * sizes['radius'] if 'radius' in sizes else None)
    is_named = kind is not None or _kind(plugin.get('name', '')) == DIFFERENTIAL
    return DriveTags(filename, kind or DIFFERENTIAL, is_named, left, right, sizes.get('separation'), diameter_m, limits)


def _number(text: str) -> Optional[float]:
    """Return a number that a robot's size or limit can have; None for 0 and enormous ones, which mean no limit."""
    try:
        number = float(text)
    except ValueError:
        return None
    return number if LEAST <= number <= MOST else None
