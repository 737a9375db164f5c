"""The tags of a URDF that name driven wheels: of Gazebo's plugins, of controllers' files, of transmissions."""

from __future__ import annotations

import re
from pathlib import Path
from typing import AbstractSet, Any, Dict, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Tuple
from xml.etree import ElementTree

from diff_encoder_sim.base.bounds import is_number
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.xml_values import MOST
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.robots.description import DrivenWheel, RobotTree
from diff_encoder_sim.robots.rolling_wheels import drivable_joints

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
_CONTROLLER_LIMITS = {
    'linear.x.{}velocity': 'max_linear_speed',
    'linear.x.{}acceleration': 'max_linear_acceleration',
    'angular.z.{}velocity': 'max_angular_speed',
    'angular.z.{}acceleration': 'max_angular_acceleration',
}
_SEPARATION_TAGS = ('wheelseparation', 'wheeltrack', 'trackwidth', 'tread')
# Whole words in the name of a plugin's file.
_KINDS = (
    (SKID_STEER, 'skid( ?steer(ing)?)? drive'),
    (STEERED, 'ackermann? (drive|steering)|((tri|bi)cycle|steer(ing)?) drive'),
    (OMNIDIRECTIONAL, r'(mecanum|omni\w*|holonomic|swerve) drive'),
    (DIFFERENTIAL, 'diff ?drive|differential'),
)
_WORD = re.compile('[A-Z]+(?![a-z])|[A-Z]?[a-z]+')
LEAST = 1e-6  # of a size or limit, in SI units


class DriveTags(NamedTuple):
    """A plugin or controller that drives wheels."""

    source: str  # the plugin's file or the controller's, as the user has named it
    kind: str
    is_named: bool  # the kind follows from the name, not only from the joints
    left_joints: Tuple[str, ...]
    right_joints: Tuple[str, ...]
    separation_m: Optional[float]
    diameter_m: Optional[float]
    limits: Dict[str, float]  # keys of DriveParams, and rim_acceleration, that of the wheel's rim [m/s^2]


def find_drive_tags(tree: RobotTree, wheels: Sequence[DrivenWheel]) -> Tuple[DriveTags, ...]:
    """Return the plugins and controllers that name wheel joints on the left and on the right, or a steering joint.

    Plugins are included too if their file is a drive plugin of another kind than differential.
    """
    carriers = drivable_joints(tree, wheels)
    above = {joint.name for wheel in wheels for joint in tree.joints_above(tree.joints[wheel.joint].parent)}
    plugins = list(tree.xml.iter('plugin'))
    # Before Gazebo 1.0 a plugin was a <controller:...> with its own name.
    old = [child for element in tree.xml.iter('gazebo') for child in element if child.tag != 'plugin']
    found = [_plugin(plugin, tree, carriers, above) for plugin in (*plugins, *old)]
    for plugin in plugins:
        for element in plugin.iter():
            if tag_letters(element) in ('parameters', 'params'):
                found += [_with_wheels(tags, tree, carriers) for tags in _controllers_of((element.text or '').strip())]
    return tuple(tags for tags in found if tags is not None)


def commanded_joints(tree: RobotTree, position: bool = False) -> Tuple[str, ...]:
    """Return the joints that transmissions and ros2_control move by speed or effort; or those by position."""
    interfaces: List[Tuple[str, str]] = []  # joint, kinds
    for transmission in tree.xml.iter('transmission'):
        kinds = ' '.join(each.text or '' for each in transmission.iter() if tag_letters(each) == 'hardwareinterface')
        interfaces += [(joint.get('name', ''), kinds) for joint in transmission.findall('joint')]
    for control in tree.xml.iter('ros2_control'):
        for joint in control.findall('joint'):
            kinds = ' '.join(command.get('name', '') for command in joint.findall('command_interface'))
            if kinds:
                interfaces.append((joint.get('name', ''), kinds))
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


def _usable(number: float) -> Optional[float]:
    """Return a number that a robot's size or limit can have; None for 0 and enormous ones, which mean no limit."""
    return float(number) if LEAST <= number <= MOST else None


def _plugin(
    plugin: ElementTree.Element, tree: RobotTree, carriers: AbstractSet[str], above: AbstractSet[str]
) -> Optional[DriveTags]:
    """Return a plugin's tags; None if it drives nothing.

    Args:
        plugin: its element.
        tree: the robot.
        carriers: joints that carry wheels.
        above: joints between these and the root, which can steer.
    """
    children = [(child, (child.text or '').strip()) for child in plugin.iter() if child is not plugin]
    worded = [(_words(child.tag), text) for child, text in children]
    filename = plugin.get('filename') or plugin.tag
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
    is_other = is_steered or (kind not in (None, DIFFERENTIAL) and plugin.tag == 'plugin')
    if not ((left and right) or is_other):
        return None
    if is_steered:
        kind = STEERED
    elif kind in (None, DIFFERENTIAL) and max(len(left), len(right)) > 1:
        kind = SKID_STEER
    numbers = [(tag_letters(child), _number_of_text(text)) for child, text in children]
    diameter_m = next((number for tag, number in numbers if tag == 'wheeldiameter'), None)
    if diameter_m is None:
        radius_m = next((number for tag, number in numbers if tag == 'wheelradius'), None)
        diameter_m = None if radius_m is None else 2.0 * radius_m
    separation_m = next((number for tag, number in numbers if tag in _SEPARATION_TAGS), None)
    last = {_LIMIT_TAGS[tag]: number for tag, number in numbers if tag in _LIMIT_TAGS}
    limits = {key: number for key, number in last.items() if number is not None}
    is_named = kind is not None or _kind(plugin.get('name', '')) == DIFFERENTIAL
    return DriveTags(filename, kind or DIFFERENTIAL, is_named, left, right, separation_m, diameter_m, limits)


def _number_of_text(text: str) -> Optional[float]:
    try:
        return _usable(float(text))
    except ValueError:
        return None


def _controllers_of(name: str) -> List[DriveTags]:
    """Return the drive controllers in a YAML file; none of a file that cannot be read, as the URDF decides then."""
    path = Path(name[len('file://') :] if name.startswith('file://') else name)
    try:
        return list(controllers_in(load_yaml(path), path.name)) if name and path.is_file() else []
    except (ConfigError, OSError):
        return []


def controllers_in(content: Any, source: str) -> Iterator[DriveTags]:
    """Yield the drive controllers in the content of a YAML file, at whatever depth."""
    if not isinstance(content, Mapping):
        return
    sides: List[Tuple[str, ...]] = []
    for side in ('left', 'right'):
        given = content.get(f'{side}_wheel_names', content.get(f'{side}_wheel'))
        names = given if isinstance(given, list) else [given]
        sides.append(tuple(dict.fromkeys(name for name in names if isinstance(name, str))))
    left, right = sides
    if left and right:
        separation_m, radius_m = _number_at(content, 'wheel_separation'), _number_at(content, 'wheel_radius')
        if separation_m is not None:
            separation_m *= _number_at(content, 'wheel_separation_multiplier') or 1.0
        scale = _number_at(content, 'wheel_radius_multiplier') or _number_at(content, 'left_wheel_radius_multiplier')
        diameter_m = None if radius_m is None else 2.0 * radius_m * (scale or 1.0)
        limits = {}
        for pattern, key in _CONTROLLER_LIMITS.items():  # each has a flag, true unless it is given
            number = _number_at(content, pattern.format('max_'))
            if number is not None and _at(content, f'{pattern.format("has_")}_limits') is not False:
                limits[key] = number
        yield DriveTags(source, DIFFERENTIAL, True, left, right, separation_m, diameter_m, limits)
    for below in content.values():
        yield from controllers_in(below, source)


def _with_wheels(tags: DriveTags, tree: RobotTree, carriers: AbstractSet[str]) -> Optional[DriveTags]:
    """Return a controller without the joints that carry no wheel; of another robot's joints only the first."""
    left, right = (
        tuple(name for name in names if name in carriers) or tuple({*names[:1]} - {*tree.joints})
        for names in (tags.left_joints, tags.right_joints)
    )
    if not (left and right):
        return None
    kind = SKID_STEER if max(len(left), len(right)) > 1 else DIFFERENTIAL
    return tags._replace(kind=kind, left_joints=left, right_joints=right)


def _at(content: Any, dotted: str) -> Any:
    """Return the value at a dotted key, which ROS 2 writes as one key and ROS 1 as nested ones."""
    if isinstance(content, Mapping) and dotted in content:
        return content[dotted]
    first, _, below = dotted.partition('.')
    return _at(content.get(first), below) if below and isinstance(content, Mapping) else None


def _number_at(content: Mapping[Any, Any], key: str) -> Optional[float]:
    value = _at(content, key)
    return _usable(value) if is_number(value) else None
