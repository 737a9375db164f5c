"""Which two wheels drive: by the user, by plugins and controllers, by transmissions, by geometry."""

from __future__ import annotations

import re
from pathlib import Path
from typing import AbstractSet, Any, Dict, Iterable, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Tuple
from xml.etree import ElementTree

from diff_encoder_sim.base.bounds import is_number
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import did_you_mean
from diff_encoder_sim.base.xml_values import MOST
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.robots.description import Findings, RobotChoices, RobotTree
from diff_encoder_sim.robots.robot_file import robot_file_line
from diff_encoder_sim.robots.rolling_wheels import (
    LIKE_RADIUS,
    RollingWheel,
    WheelPair,
    are_coaxial,
    are_parallel,
    coaxial_pairs,
    joints_above,
    left_first,
    rolling_wheels,
    spins,
    wheel_joints,
    wheel_of,
    without_casters,
)

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
        return usable(float(text or ''))
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


_MODELLED = 'modelled are two driven wheels on one axle'
_UNLIKE = {
    SKID_STEER: 'a robot with two or more driven axles (skid-steer, or mecanum), whose wheels slip in each turn',
    STEERED: 'a robot with a steered wheel (tricycle or Ackermann)',
    OMNIDIRECTIONAL: 'an omnidirectional robot, whose wheels have rollers',
}


def unlike(tree: RobotTree, kind: str, reason: str) -> ConfigError:
    """Return the error for a robot whose drive is not modelled."""
    override = f'to simulate two of its wheels as the drive: {_chosen_wheels(tree)}'
    return ConfigError(f'{tree.where}: given {_UNLIKE[kind]} ({reason}); {_MODELLED}; {override}')


def _no_pair(tree: RobotTree, given: str) -> ConfigError:
    """Return the error for a robot without two wheels of which one knows that they drive."""
    return ConfigError(
        f'{tree.where}: given {given}; allowed: two driven wheels on one axle; to name them: {_chosen_wheels(tree)}'
    )


def _chosen_wheels(tree: RobotTree) -> str:
    """Return the robot file that names two wheels, with those of a pair if there is one."""
    pairs = coaxial_pairs(rolling_wheels(tree))
    left, right = max(pairs, key=lambda pair: pair.radius_m).joints if pairs else ('LEFT_JOINT', 'RIGHT_JOINT')
    return robot_file_line(tree.where, set={'simulator.left_joint': left, 'simulator.right_joint': right})


def check_plugins(tree: RobotTree, plugins: Iterable[DriveTags]) -> None:
    """Refuse a robot whose plugins are not those of a differential drive.

    Raises:
        ConfigError: the robot skids, steers or moves sideways.
    """
    for tags in plugins:
        if tags.kind in _UNLIKE:
            raise unlike(tree, tags.kind, f'plugin {tags.source}{_named(tags.left_joints + tags.right_joints)}')


def check_one_pair(tree: RobotTree, plugins: Iterable[DriveTags]) -> None:
    """Refuse drive plugins with a pair of wheels each.

    Raises:
        ConfigError: the robot skids.
    """
    drives = [tags for tags in plugins if tags.kind == DIFFERENTIAL and tags.is_named]
    pairs = {frozenset(tags.left_joints + tags.right_joints) for tags in drives}
    driven = [pair for pair in pairs if pair <= set(tree.joints)]
    if len(driven) > 1:
        names = tuple(sorted(joint for pair in driven for joint in pair))
        raise unlike(tree, SKID_STEER, f'plugins{_named(names)}')


def check_pair(tree: RobotTree, pair: WheelPair, is_named: bool, wheels: Sequence[RollingWheel]) -> None:
    """Refuse a pair of wheels which a plugin names, if others steer, or drive on another axle.

    Args:
        tree: the robot.
        pair: the wheels.
        is_named: the plugin is one of differential drives. Otherwise all wheels of the pair's size are driven; of such
            a plugin only those that are commanded, too.
        wheels: from rolling_wheels.

    Raises:
        ConfigError: the robot skids or steers.
    """
    check_steering(tree, wheels, is_named)
    commanded = commanded_joints(tree)
    driven = [wheel for wheel in wheels if wheel.swivel is None and (not is_named or wheel.joint in commanded)]
    same = {pair.left.joint, *(wheel.joint for wheel in wheels if are_coaxial(wheel, pair.left))}
    others = [each for each in coaxial_pairs(driven) if each.left.joint not in same]
    like = [each for each in others if abs(each.radius_m - pair.radius_m) <= LIKE_RADIUS * pair.radius_m]
    if like:
        raise unlike(tree, SKID_STEER, f'wheels of one size: {_quoted([*pair.joints, *like[0].joints])}')


def check_steering(tree: RobotTree, wheels: Iterable[RollingWheel], is_differential: bool = False) -> None:
    """Refuse a wheel on a swivel that is commanded, or that has limits if the file does not show what is commanded.

    Args:
        tree: the robot.
        wheels: from rolling_wheels.
        is_differential: a plugin shows it, so that only swivels commanded by position steer.

    Raises:
        ConfigError: the robot steers.
    """
    commanded = commanded_joints(tree, position=True) + (() if is_differential else commanded_joints(tree))
    for wheel in wheels:
        is_limited = wheel.swivel and not spins(tree, tree.joints[wheel.swivel])
        if wheel.swivel in commanded or (is_limited and not commanded and not is_differential):
            raise unlike(tree, STEERED, f'joint {wheel.swivel!r} turns wheel {wheel.link!r} about an upright axis')


def check_wheels(tree: RobotTree, wheels: Sequence[RollingWheel]) -> None:
    """Refuse what has not two wheels on one axle, and no others like them, by their number and places.

    Raises:
        ConfigError: the robot has no wheels, one, three on an axle, four to skid on, or wheels that roll sideways.
    """
    names, pairs = _quoted(wheel.joint for wheel in wheels), coaxial_pairs(wheels)
    if not wheels:
        raise _no_pair(tree, f'a robot without wheels: {_turning_joints(tree)}')
    if len(wheels) == 1:
        raise _no_pair(tree, f'one wheel, joint {names}')
    if not pairs and any(not are_parallel(wheel, wheels[0]) for wheel in wheels):
        raise unlike(tree, OMNIDIRECTIONAL, f'the axles of {names} point in different directions')
    if not pairs:
        raise _no_pair(tree, f'wheels that are not on one axle or not of one size: {names}')
    _check_axles(tree, [pair for pair in pairs if pair.radius_m > (1.0 - LIKE_RADIUS) * _largest(pairs).radius_m])


def _check_axles(tree: RobotTree, pairs: Sequence[WheelPair]) -> None:
    """Refuse more than one pair of wheels of one size."""
    if len(pairs) < 2:
        return
    joints = list(dict.fromkeys(joint for pair in pairs for joint in pair.joints))
    if len(joints) < 2 * len(pairs):
        raise _no_pair(tree, f'three or more wheels on one axle: {_quoted(joints)}')
    if any(not are_parallel(pair.left, pairs[0].left) for pair in pairs):
        raise unlike(tree, OMNIDIRECTIONAL, f'the axles of {_quoted(joints)} point in different directions')
    raise unlike(tree, SKID_STEER, f'wheels of one size: {_quoted(joints)}')


def _largest(pairs: Iterable[WheelPair]) -> WheelPair:
    return max(pairs, key=lambda pair: pair.radius_m)


def _quoted(names: Iterable[str]) -> str:
    return ', '.join(map(repr, names))


def _named(joints: Tuple[str, ...]) -> str:
    return f' with {_quoted(joints)}' if joints else ''


def _turning_joints(tree: RobotTree) -> str:
    """Return what the robot has in place of wheels."""
    turning = [joint.name for joint in tree.joints.values() if spins(tree, joint)]
    if turning:
        shown = _quoted(turning[:4]) + (' ...' if len(turning) > 4 else '')
        return f'of its joints that turn without end ({shown}) none has a level axis and a round shape near the floor'
    return f'none of its {len(tree.joints)} joints is continuous'


LEAST_ACROSS = 0.985  # y part of an axle that lies across the robot (10 degrees)


def choose_wheels(
    tree: RobotTree, wheels: Sequence[RollingWheel], drives: Sequence[DriveTags], choices: RobotChoices, seen: Findings
) -> WheelPair:
    """Return the two driven wheels; where from is added to the table.

    Args:
        tree: the robot, meshes replaced.
        wheels: from rolling_wheels.
        drives: from gazebo_tags and controller_tags.
        choices: the user's.
        seen: takes what is found.

    Raises:
        ConfigError: the robot is no differential drive, or the choice is no pair of wheels.
    """
    pair, source = (
        _chosen(tree, wheels, choices)
        or _by_plugin(tree, wheels, drives, seen)
        or _by_evidence(tree, wheels, drives, seen)
    )
    _check_axle(tree, pair)
    seen.add('left wheel joint', pair.left.joint, source)
    seen.add('right wheel joint', pair.right.joint, source)
    _check_names(pair, seen)
    _check_others(pair, wheels, seen)
    return pair


def _chosen(tree: RobotTree, wheels: Sequence[RollingWheel], choices: RobotChoices) -> Optional[Tuple[WheelPair, str]]:
    """Return the user's pair; of one alone, with the wheel on its axle."""
    if choices.left_joint is None and choices.right_joint is None:
        return None
    given = [_users_wheel(tree, choices.left_joint, 'left'), _users_wheel(tree, choices.right_joint, 'right')]
    left, right = given
    if left is None or right is None:
        one = left or right
        assert one is not None
        others = [wheel for wheel in wheels if wheel.joint != one.joint and are_coaxial(wheel, one)]
        if len(others) != 1:
            raise ConfigError(
                f"{tree.where}: given joint {one.joint!r} alone; allowed: both of the driven wheels' joints"
            )
        left, right = left or others[0], right or others[0]
    if left.centre_m[1] <= right.centre_m[1]:
        raise ConfigError(
            f'{tree.where}: given {left.joint!r} as left wheel at y = {left.centre_m[1]:.3f} m and {right.joint!r} as '
            f'right wheel at {right.centre_m[1]:.3f} m; allowed: the left wheel left of the right one, x forward'
        )
    return WheelPair(left, right), 'given'


def _users_wheel(tree: RobotTree, name: Optional[str], side: str) -> Optional[RollingWheel]:
    if name is None:
        return None
    joint = tree.joints.get(name)
    if joint is None:
        hint = did_you_mean(name, tree.joints)
        raise ConfigError(
            f'{tree.where}: given {name!r} as {side} wheel joint, which is missing; '
            f'allowed: one of {", ".join(tree.joints) or "none, the robot has no joint"}{hint}'
        )
    if joint.kind not in ('continuous', 'revolute'):
        raise ConfigError(
            f'{tree.where}: given {name!r} as {side} wheel joint, which is {joint.kind}; allowed: continuous'
        )
    return wheel_of(tree, joint)


def _by_plugin(
    tree: RobotTree, wheels: Sequence[RollingWheel], drives: Sequence[DriveTags], seen: Findings
) -> Optional[Tuple[WheelPair, str]]:
    """Return the pair of the first differential drive whose joints the robot has; of those by name first."""
    check_one_pair(tree, drives)
    for tags in sorted(drives, key=lambda tags: not tags.is_named):
        if tags.kind != DIFFERENTIAL:
            continue
        left, right = tree.joints.get(tags.left_joints[0]), tree.joints.get(tags.right_joints[0])
        if left is None or right is None:
            missing = tags.left_joints[0] if left is None else tags.right_joints[0]
            seen.warn(f'{tags.source} names joint {missing!r}, which the robot does not have')
        elif left.name != right.name and spins(tree, left) and spins(tree, right):
            pair = left_first(wheel_of(tree, left), wheel_of(tree, right))
            check_pair(tree, pair, tags.is_named, wheels)
            if pair.left.joint != left.name:
                seen.warn(f'{tags.source} names {left.name!r} as left joint, which is on the right: taken as right one')
            return pair, tags.source
    return None


def _by_evidence(
    tree: RobotTree, wheels: Sequence[RollingWheel], drives: Sequence[DriveTags], seen: Findings
) -> Tuple[WheelPair, str]:
    """Return the pair that follows from transmissions, sizes and names, where no plugin does."""
    check_plugins(tree, drives)
    check_steering(tree, wheels)
    commanded = [wheel for wheel in wheels if wheel.joint in commanded_joints(tree) and not wheel.swivel]
    if len(commanded) == 2 and are_coaxial(*commanded):
        return left_first(*commanded), 'transmissions'
    driven = commanded if len(commanded) > 2 else wheels
    fixed = without_casters([wheel for wheel in driven if not wheel.swivel])
    check_wheels(tree, fixed)
    pairs = coaxial_pairs(fixed)
    pair = max(pairs, key=lambda pair: pair.radius_m)
    if len(pairs) > 1:
        others = ', '.join(repr(joint) for other in pairs if other is not pair for joint in other.joints)
        seen.warn(
            f'the largest wheels, {pair.joints[0]!r} and {pair.joints[1]!r}, are taken to be driven '
            f'and {others} to be casters'
        )
    return pair, 'transmissions and geometry' if driven is commanded else 'geometry'


def _check_axle(tree: RobotTree, pair: WheelPair) -> None:
    """Refuse an axle that does not lie across the robot."""
    x_m, y_m, z_m = (pair.left.centre_m - pair.right.centre_m).tolist()
    names = f'joints {pair.left.joint!r} and {pair.right.joint!r}'
    if y_m <= 0.0 or abs(y_m) < LEAST_ACROSS * (x_m**2 + y_m**2 + z_m**2) ** 0.5:
        drives = 'so it drives along y' if abs(x_m) > abs(y_m) else 'so they are not on one axle'
        raise ConfigError(
            f'{tree.where}: given {names} apart by ({x_m:.3f}, {y_m:.3f}, {z_m:.3f}) m, {drives}; '
            f'allowed: wheels apart along y, x forward (REP 103) in root link {tree.root!r}'
        )
    for wheel in pair:
        if abs(wheel.axis[1]) < LEAST_ACROSS:
            axis = ', '.join(f'{part:.2f}' for part in wheel.axis)
            raise ConfigError(
                f'{tree.where}: given joint {wheel.joint!r} about the axis ({axis}) of root link {tree.root!r}; '
                'allowed: a wheel that turns about y, so that it drives along x'
            )


def _check_others(pair: WheelPair, wheels: Sequence[RollingWheel], seen: Findings) -> None:
    """Warn of wheels on another axle that are as large: they may be driven, too, and they resist turns."""
    others = [
        repr(wheel.joint)
        for wheel in wheels
        if wheel.joint not in pair.joints
        and wheel.swivel is None
        and abs((wheel.radius_m or 0.0) - pair.radius_m) <= LIKE_RADIUS * pair.radius_m
    ]
    if others:
        seen.warn(f'the wheels of {", ".join(others)} slide without friction: what they do in turns is not modelled')


def _check_names(pair: WheelPair, seen: Findings) -> None:
    """Warn where a wheel is called by the other side's name."""
    for wheel, other in ((pair.left, 'right'), (pair.right, 'left')):
        side = 'left' if other == 'right' else 'right'
        if re.search(other, wheel.joint, re.IGNORECASE) and not re.search(side, wheel.joint, re.IGNORECASE):
            y_m = wheel.centre_m[1]
            seen.warn(
                f"joint {wheel.joint!r} is the {side} wheel (y = {y_m:+.3f} m): is x forward in the robot's root link?"
            )


_LIMITS = {
    ('linear', 'max_velocity'): 'max_linear_speed',
    ('linear', 'max_acceleration'): 'max_linear_acceleration',
    ('angular', 'max_velocity'): 'max_angular_speed',
    ('angular', 'max_acceleration'): 'max_angular_acceleration',
}


def controllers(tree: RobotTree, wheels: Sequence[RollingWheel]) -> Tuple[DriveTags, ...]:
    """Return the drive controllers in the parameter files that plugins name and that exist."""
    found: List[DriveTags] = []
    for plugin in tree.xml.iter('plugin'):
        for element in plugin.iter():
            if tag_words(element) in ('parameters', 'params'):
                found += _in_file((element.text or '').strip())
    carriers = wheel_joints(tree, wheels)
    return tuple(tags for each in found for tags in _of_robot(each, tree, carriers))


def controllers_in(content: Any, source: str) -> Iterator[DriveTags]:
    """Yield the drive controllers in the content of a YAML file, at whatever depth."""
    if not isinstance(content, Mapping):
        return
    left, right = (_names(content, side) for side in ('left', 'right'))
    if left and right:
        yield _controller(content, left, right, source)
    for below in content.values():
        yield from controllers_in(below, source)


def _of_robot(tags: DriveTags, tree: RobotTree, carriers: AbstractSet[str]) -> Iterator[DriveTags]:
    """Yield a controller without the joints that carry no wheel; of another robot's joints only the first."""
    left, right = (
        tuple(name for name in names if name in carriers) or tuple({*names[:1]} - {*tree.joints})
        for names in (tags.left_joints, tags.right_joints)
    )
    if left and right:
        kind = SKID_STEER if max(len(left), len(right)) > 1 else DIFFERENTIAL
        yield tags._replace(kind=kind, left_joints=left, right_joints=right)


def _in_file(name: str) -> Iterator[DriveTags]:
    path = Path(name[len('file://') :] if name.startswith('file://') else name)
    try:
        if name and path.is_file():
            yield from controllers_in(load_yaml(path), path.name)
    except (ConfigError, OSError):
        return  # the controller's own affair: the URDF alone decides


def _controller(content: Mapping[Any, Any], left: Tuple[str, ...], right: Tuple[str, ...], source: str) -> DriveTags:
    separation_m, radius_m = _number(content, 'wheel_separation'), _number(content, 'wheel_radius')
    if separation_m is not None:
        separation_m *= _number(content, 'wheel_separation_multiplier') or 1.0
    if radius_m is not None:
        radius_m *= (
            _number(content, 'wheel_radius_multiplier') or _number(content, 'left_wheel_radius_multiplier') or 1.0
        )
    diameter_m = None if radius_m is None else 2.0 * radius_m
    return DriveTags(source, DIFFERENTIAL, True, left, right, separation_m, diameter_m, _limits(content))


def _names(content: Mapping[Any, Any], side: str) -> Tuple[str, ...]:
    given = content.get(f'{side}_wheel_names', content.get(f'{side}_wheel'))
    names = given if isinstance(given, list) else [given]
    return tuple(dict.fromkeys(name for name in names if isinstance(name, str)))


def _limits(content: Mapping[Any, Any]) -> Dict[str, float]:
    """Return the limits that hold: each has a flag, true unless it is given."""
    limits = {}
    for (motion, name), key in _LIMITS.items():
        axis = f'{motion}.{"x" if motion == "linear" else "z"}'
        flag = _at(content, f'{axis}.has_{name.replace("max_", "")}_limits')
        number = _number(content, f'{axis}.{name}')
        if number is not None and flag is not False:
            limits[key] = number
    return limits


def _at(content: Any, dotted: str) -> Any:
    """Return what stands at a dotted key, which ROS 2 writes as one key and ROS 1 as nested ones."""
    if isinstance(content, Mapping) and dotted in content:
        return content[dotted]
    first, _, below = dotted.partition('.')
    return _at(content.get(first), below) if below and isinstance(content, Mapping) else None


def _number(content: Mapping[Any, Any], key: str) -> Optional[float]:
    value = _at(content, key)
    return usable(value) if is_number(value) else None
