"""The wheels of a robot, and which two drive it: by the user, by plugins, by transmissions, by geometry.

A wheel is a link that turns without end about a level axis and has a shape that rolls.
"""

from __future__ import annotations

import re
from itertools import combinations
from typing import Dict, Iterable, List, NamedTuple, Optional, Sequence, Tuple
from xml.etree import ElementTree

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import did_you_mean
from diff_encoder_sim.base.xml_values import MOST, finite_numbers
from diff_encoder_sim.robots.description import DrivenWheel, Findings, Joint, RobotChoices, RobotTree, robot_file_line
from diff_encoder_sim.robots.solids import vector

LEVEL = 0.17  # an axis' vertical part (10 degrees), below which a wheel can stand on it
SAME_RADIUS = 0.01  # shapes of one wheel: twin tyres, a tyre and its rim
PASSIVE = re.compile('caster|castor|idler|passive|support|roller|ball', re.IGNORECASE)
NEAR_FLOOR = 0.35  # of its radius: how far above the lowest wheel a wheel may end

PARALLEL = 0.995  # cosine
OFF_LINE = 0.1  # of the radius: how far a wheel may be off the other's axis
LIKE_RADIUS = 0.05
LEAST_SEPARATION = 0.2  # of the radius
LEAST_ACROSS = 0.985  # y part of an axle that lies across the robot (10 degrees)

DIFFERENTIAL = 'differential'
SKID_STEER = 'a robot with two or more driven axles (skid-steer, or mecanum), whose wheels slip in each turn'
STEERED = 'a robot with a steered wheel (tricycle or Ackermann)'
OMNIDIRECTIONAL = 'an omnidirectional robot, whose wheels have rollers'
# Whole words in the name of a plugin's file.
_KINDS = (
    (SKID_STEER, 'skid( ?steer(ing)?)? drive'),
    (STEERED, 'ackermann? (drive|steering)|((tri|bi)cycle|steer(ing)?) drive'),
    (OMNIDIRECTIONAL, r'(mecanum|omni\w*|holonomic|swerve) drive'),
    (DIFFERENTIAL, 'diff ?drive|differential'),
)
_WORD = re.compile('[A-Z]+(?![a-z])|[A-Z]?[a-z]+')

# Quantities with the tags that give them, in lower-case letters only; limits under the keys of DriveParams.
_QUANTITIES = {
    'separation': 'wheelseparation wheeltrack trackwidth tread',
    'diameter': 'wheeldiameter',
    'radius': 'wheelradius',
    'wheel_torque': 'wheeltorque maxwheeltorque torque',
    'max_linear_speed': 'maxlinearvelocity',
    'max_angular_speed': 'maxangularvelocity',
    'max_linear_acceleration': 'maxlinearacceleration',
    'max_angular_acceleration': 'maxangularacceleration',
    'rim_acceleration': 'wheelacceleration maxwheelacceleration',
}
_TAGS = {tag: quantity for quantity, tags in _QUANTITIES.items() for tag in tags.split()}
LEAST = 1e-6  # of a size or limit, in SI units; 0 and enormous ones mean no limit

WheelPair = Tuple[DrivenWheel, DrivenWheel]  # left, right


class DrivePlugin(NamedTuple):
    """A plugin that drives wheels."""

    source: str  # the plugin's file
    kind: str
    is_named: bool  # the kind follows from the name, not only from the joints
    left_joints: Tuple[str, ...]
    right_joints: Tuple[str, ...]
    separation_m: Optional[float]
    diameter_m: Optional[float]
    limits: Dict[str, float]  # keys of DriveParams, and rim_acceleration, that of the wheel's rim [m/s^2]


def tag_letters(element: ElementTree.Element) -> str:
    """Return a tag in lower-case letters only: leftJoint and left_joint are the same."""
    return re.sub('[^a-z]', '', element.tag.lower())


def _words(name: str) -> List[str]:
    """Return the words of a name in lower case: leftWheelTF and left_wheel_tf are the same."""
    return [word.lower() for word in _WORD.findall(re.sub('^lib', '', name.rsplit('/', 1)[-1]))]


def _kind(name: str) -> Optional[str]:
    words = ' '.join(_words(name))
    return next((kind for kind, pattern in _KINDS if re.search(rf'\b({pattern})\b', words)), None)


def drive_plugins(tree: RobotTree, wheels: Sequence[DrivenWheel]) -> Tuple[DrivePlugin, ...]:
    """Return the plugins that name wheel joints on the left and on the right, or a steering joint.

    Plugins are included too if their file is a drive plugin of another kind than differential.
    """
    # Joints that can drive the robot: without two (wheels may lack a round shape) all that spin about a level axis.
    carriers = {wheel.joint for wheel in _without_casters(wheels)}
    if len(carriers) < 2:
        spinning = (joint for joint in tree.joints.values() if joint.spins)
        carriers = {joint.name for joint in spinning if abs(tree.axis_in_root(joint)[2]) < LEVEL}
    steering = {joint.name for wheel in wheels for joint in tree.joints_above(tree.joints[wheel.joint].parent)}
    found: List[DrivePlugin] = []
    for plugin in tree.xml.iter('plugin'):
        tags = [(child, (child.text or '').strip()) for child in plugin.iter() if child is not plugin]
        worded, filename = [(_words(child.tag), text) for child, text in tags], plugin.get('filename', '')
        kind = _kind(filename)
        left, right = (_named_joints(worded, side, carriers, tree, kind is not None) for side in ('left', 'right'))
        is_steered = any(text in steering and {'steer', 'steering'}.intersection(words) for words, text in worded)
        if not ((left and right) or is_steered or kind not in (None, DIFFERENTIAL)):
            continue
        is_named = kind is not None or _kind(plugin.get('name', '')) == DIFFERENTIAL
        if is_steered:
            kind = STEERED
        elif kind in (None, DIFFERENTIAL) and max(len(left), len(right)) > 1:
            kind = SKID_STEER
        numbers: Dict[str, float] = {}  # the first of each quantity
        for child, text in tags:
            given = finite_numbers(text)
            if tag_letters(child) in _TAGS and len(given) == 1 and LEAST <= given[0] <= MOST:
                numbers.setdefault(_TAGS[tag_letters(child)], given[0])
        separation_m, radius_m = numbers.pop('separation', None), numbers.pop('radius', None)
        diameter_m = numbers.pop('diameter', radius_m and 2.0 * radius_m)
        kind = kind or DIFFERENTIAL
        found.append(DrivePlugin(filename, kind, is_named, left, right, separation_m, diameter_m, numbers))
    return tuple(found)


def _named_joints(
    worded: Sequence[Tuple[List[str], str]], side: str, carriers: Iterable[str], tree: RobotTree, is_drive: bool
) -> Tuple[str, ...]:
    """Return wheel joints of a side: one for each tag, or a list as in XML or by commas.

    Without any, it is a joint that the robot does not have, if the plugin's name is that of a drive.
    """
    texts = [(words, text) for words, text in worded if side in words]
    names = [name for _, text in texts for name in (text, *re.split(r'[\s,]+', text)) if name in carriers]
    of_joints = (text for words, text in texts if 'joint' in words and words[-1] in ('joint', 'name'))
    missing = [name for name in of_joints if name not in tree.joints]
    return tuple(dict.fromkeys(names)) or tuple(missing[: int(is_drive)])


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


def rolling_wheels(tree: RobotTree) -> Tuple[DrivenWheel, ...]:
    """Return the wheels near the floor, in the file's order: none of an arm, no spinning scanner."""
    found = [wheel_of(tree, joint) for joint in tree.joints.values() if joint.spins]
    level = [wheel for wheel in found if wheel.radius_m and abs(wheel.axis[2]) < LEVEL]
    bottoms_m = [wheel.centre_m[2] - wheel.radius_m for wheel in level]
    heights_m = [bottom_m - min(bottoms_m) for bottom_m in bottoms_m]
    return tuple(wheel for wheel, up_m in zip(level, heights_m) if up_m < NEAR_FLOOR * wheel.radius_m)


def wheel_of(tree: RobotTree, joint: Joint) -> DrivenWheel:
    """Return the wheel that a joint turns, by the largest of its shapes that roll; collision shapes first."""
    pose = tree.poses[joint.child]
    to_wheel = np.linalg.inv(pose)
    parts = [(tree.links[name], to_wheel @ tree.poses[name]) for name in tree.subtree(joint.child, is_rigid=True)]
    radius_m, centre_m, source = 0.0, np.zeros(3), 'no rolling shape'
    for kind in ('collision', 'visual'):
        shapes = [shape.placed(at) for link, at in parts for shape in getattr(link, f'{kind}s')]
        radii = [(shape.rolling_radius_m(joint.axis), shape) for shape in shapes]
        radius_m = max((radius for radius, _ in radii), default=0.0)
        if radius_m > 0.0:
            largest = [shape for radius, shape in radii if radius > (1.0 - SAME_RADIUS) * radius_m]
            centre_m = np.mean([shape.pose_in_link[:3, 3] for shape in largest], axis=0)
            source = f'{kind} {type(largest[0].geometry).__name__.lower()}'
            break
    swivel = tree.swivel_above(joint.parent)
    centre_in_root_m, axis = vector(pose[:3, :3] @ centre_m + pose[:3, 3]), vector(tree.axis_in_root(joint))
    return DrivenWheel(joint.name, joint.child, centre_in_root_m, axis, radius_m, source, swivel and swivel.name)


def _without_casters(wheels: Sequence[DrivenWheel]) -> List[DrivenWheel]:
    """Leave out wheels that swivel, and those that are casters by name if two others remain."""
    fixed = [wheel for wheel in wheels if wheel.swivel is None]
    driven = [wheel for wheel in fixed if not PASSIVE.search(f'{wheel.joint} {wheel.link}')]
    return driven if len(driven) >= 2 else fixed


def _coaxial_pairs(wheels: Iterable[DrivenWheel]) -> List[WheelPair]:
    """Return all pairs of like wheels on one axle; of three on one axle, three pairs."""
    return [_left_first(a, b) for a, b in combinations(wheels, 2) if _are_coaxial(a, b)]


def _left_first(a: DrivenWheel, b: DrivenWheel) -> WheelPair:
    return (a, b) if a.centre_m[1] >= b.centre_m[1] else (b, a)


def joints_of(pair: WheelPair) -> Tuple[str, str]:
    """Return the joints' names, left first."""
    return pair[0].joint, pair[1].joint


def _mean_radius_m(pair: WheelPair) -> float:
    return 0.5 * (pair[0].radius_m + pair[1].radius_m)


def _are_parallel(a: DrivenWheel, b: DrivenWheel) -> bool:
    return bool(abs(np.dot(a.axis, b.axis)) > PARALLEL)


def _are_coaxial(a: DrivenWheel, b: DrivenWheel) -> bool:
    """Return whether two wheels have one axis and one radius, side by side."""
    apart_m, larger_m = np.subtract(b.centre_m, a.centre_m), max(a.radius_m, b.radius_m)
    return bool(
        _are_parallel(a, b)
        and np.linalg.norm(np.cross(apart_m, a.axis)) < OFF_LINE * larger_m
        and abs(apart_m @ a.axis) > LEAST_SEPARATION * larger_m
        and abs(a.radius_m - b.radius_m) <= LIKE_RADIUS * larger_m
    )


def _are_alike(other: WheelPair, pair: WheelPair) -> bool:
    return abs(_mean_radius_m(other) - _mean_radius_m(pair)) <= LIKE_RADIUS * _mean_radius_m(pair)


def _quoted(names: Iterable[str]) -> str:
    return ', '.join(map(repr, names))


class DriveSearch:
    """The search for the two driven wheels of a robot whose meshes are replaced."""

    def __init__(self, tree: RobotTree, seen: Findings) -> None:
        self._tree, self._seen, self._wheels = tree, seen, rolling_wheels(tree)
        self.plugins, self._commanded = drive_plugins(tree, self._wheels), commanded_joints(tree)

    def pair(self, choices: RobotChoices) -> WheelPair:
        """Return the driven wheels, their source added to the table; ConfigError if they form no differential drive."""
        tree, seen = self._tree, self._seen
        pair, source = self._chosen(choices) or self._by_plugin() or self._by_evidence()
        apart_m, y_m = np.subtract(pair[0].centre_m, pair[1].centre_m), pair[0].centre_m[1] - pair[1].centre_m[1]
        turn_across = all(abs(wheel.axis[1]) >= LEAST_ACROSS for wheel in pair)
        if y_m <= 0.0 or y_m < LEAST_ACROSS * np.linalg.norm(apart_m) or not turn_across:
            apart = ', '.join(f'{part:.3f}' for part in apart_m)
            given = f'given joints {pair[0].joint!r} and {pair[1].joint!r} apart by ({apart}) m'
            allowed = 'wheels apart along y that turn about y, x forward (REP 103)'
            raise ConfigError(f'{tree.where}: {given}; allowed: {allowed} in root link {tree.root!r}')
        for side, other, wheel in (('left', 'right', pair[0]), ('right', 'left', pair[1])):
            seen.add(f'{side} wheel joint', wheel.joint, source)
            name = wheel.joint.lower()
            if other in name and side not in name:
                place = f'is the {side} wheel (y = {wheel.centre_m[1]:+.3f} m)'
                seen.warn(f"joint {wheel.joint!r} {place}: is x forward in the robot's root link?")
        # As large ones on another axle may be driven, too, and they resist turns.
        others = [each for each in self._wheels if each.joint not in joints_of(pair) and each.swivel is None]
        like = [each.joint for each in others if _are_alike((each, each), pair)]
        if like:
            seen.warn(f'the wheels of {_quoted(like)} slide without friction: what they do in turns is not modelled')
        return pair

    def _chosen(self, choices: RobotChoices) -> Optional[Tuple[WheelPair, str]]:
        """Return the user's pair; if only one is given, with the wheel on its axle."""
        where, joints = self._tree.where, self._tree.joints
        given: List[Optional[DrivenWheel]] = []
        for side, name in (('left', choices.left_joint), ('right', choices.right_joint)):
            joint = joints.get(name or '')
            if name and (joint is None or joint.kind not in ('continuous', 'revolute')):
                fault = f'{name!r} as {side} wheel joint, which is {joint.kind if joint else "missing"}'
                known = ', '.join(each.name for each in joints.values() if each.spins)
                hint = '' if joint else did_you_mean(name, joints)
                raise ConfigError(f'{where}: given {fault}; allowed: one that turns without end: {known}{hint}')
            given.append(joint and wheel_of(self._tree, joint))
        one = given[0] or given[1]
        if one is None:
            return None
        others = [wheel for wheel in self._wheels if wheel.joint != one.joint and _are_coaxial(wheel, one)]
        if None in given and len(others) != 1:
            raise ConfigError(f"{where}: given joint {one.joint!r} alone; allowed: both of the driven wheels' joints")
        left, right = (each or others[0] for each in given)
        if left.centre_m[1] <= right.centre_m[1]:
            raise ConfigError(
                f'{where}: given {left.joint!r} as left wheel at y = {left.centre_m[1]:.3f} m and {right.joint!r} as '
                f'right wheel at {right.centre_m[1]:.3f} m; allowed: the left wheel left of the right one, x forward'
            )
        return (left, right), 'given'

    def _by_plugin(self) -> Optional[Tuple[WheelPair, str]]:
        """Return the pair of the first differential drive whose joints the robot has; of those by name first.

        Others must not steer, or drive on another axle. If the name of the plugin is not one of differential drives,
        all wheels of the pair's size are driven; otherwise only those that are commanded, too.
        """
        joints, warn = self._tree.joints, self._seen.warn
        ours = [plugin for plugin in self.plugins if plugin.kind == DIFFERENTIAL]
        named = {frozenset(plugin.left_joints + plugin.right_joints) for plugin in ours if plugin.is_named}
        pairs = [pair for pair in named if pair <= set(joints)]
        if len(pairs) > 1:
            raise self._refused(SKID_STEER, f'plugins with {_quoted(sorted(name for pair in pairs for name in pair))}')
        for plugin in sorted(ours, key=lambda plugin: not plugin.is_named):
            left, right = joints.get(plugin.left_joints[0]), joints.get(plugin.right_joints[0])
            if left is None or right is None:
                missing = plugin.left_joints[0] if left is None else plugin.right_joints[0]
                warn(f'{plugin.source} names joint {missing!r}, which the robot does not have')
            elif left.name != right.name and left.spins and right.spins:
                pair = _left_first(wheel_of(self._tree, left), wheel_of(self._tree, right))
                self._check_steering(is_differential=plugin.is_named)
                fixed = [wheel for wheel in self._wheels if wheel.swivel is None]
                driven = [wheel for wheel in fixed if not plugin.is_named or wheel.joint in self._commanded]
                same = {pair[0].joint, *(wheel.joint for wheel in self._wheels if _are_coaxial(wheel, pair[0]))}
                others = [each for each in _coaxial_pairs(driven) if each[0].joint not in same]
                like = [joint for each in others if _are_alike(each, pair) for joint in joints_of(each)]
                if like:
                    raise self._refused(SKID_STEER, f'wheels of one size: {_quoted([*joints_of(pair), *like[:2]])}')
                if pair[0].joint != left.name:
                    warn(
                        f'{plugin.source} names {left.name!r} as left joint, which is on the right: taken as right one'
                    )
                return pair, plugin.source
        return None

    def _check_steering(self, is_differential: bool = False) -> None:
        """Refuse a wheel on a swivel that is commanded, or that has limits if the file does not show what is commanded.

        If a plugin shows that the robot is a differential drive, only swivels commanded by position steer.
        """
        commanded = commanded_joints(self._tree, position=True) + (() if is_differential else self._commanded)
        for wheel in self._wheels:
            is_limited = wheel.swivel and not self._tree.joints[wheel.swivel].spins
            if wheel.swivel in commanded or (is_limited and not commanded and not is_differential):
                reason = f'joint {wheel.swivel!r} turns wheel {wheel.link!r} about an upright axis'
                raise self._refused(STEERED, reason)

    def _by_evidence(self) -> Tuple[WheelPair, str]:
        """Return the pair that follows from transmissions, sizes and names, if no plugin names it."""
        for plugin in self.plugins:
            if plugin.kind != DIFFERENTIAL:
                joints = plugin.left_joints + plugin.right_joints
                with_joints = f' with {_quoted(joints)}' if joints else ''
                raise self._refused(plugin.kind, f'plugin {plugin.source}{with_joints}')
        self._check_steering()
        commanded = [wheel for wheel in self._wheels if wheel.joint in self._commanded and not wheel.swivel]
        if len(commanded) == 2 and _are_coaxial(*commanded):
            return _left_first(*commanded), 'transmissions'
        driven = commanded if len(commanded) > 2 else self._wheels
        pairs = self._pairs_on_one_axle(_without_casters(driven))
        pair = max(pairs, key=_mean_radius_m)
        if len(pairs) > 1:
            others = _quoted(joint for other in pairs if other is not pair for joint in joints_of(other))
            largest = ' and '.join(map(repr, joints_of(pair)))
            self._seen.warn(f'the largest wheels, {largest}, are taken to be driven and {others} to be casters')
        return pair, 'transmissions and geometry' if driven is commanded else 'geometry'

    def _pairs_on_one_axle(self, wheels: Sequence[DrivenWheel]) -> List[WheelPair]:
        """Return the pairs of wheels on one axle; refuse a robot without one, or with several of the largest size."""
        pairs, names = _coaxial_pairs(wheels), _quoted(wheel.joint for wheel in wheels)
        if not pairs and any(not _are_parallel(wheel, wheels[0]) for wheel in wheels):
            raise self._refused(OMNIDIRECTIONAL, f'the axles of {names} point in different directions')
        if not pairs:
            turning = _quoted(joint.name for joint in self._tree.joints.values() if joint.spins) or 'none'
            wanted = 'a level axis, a round shape near the floor, and one axle and size with another'
            reason = f'joints that turn without end: {turning}; a wheel has {wanted}'
            raise self._refused(f'the wheels {names}' if wheels else 'a robot without wheels', reason)
        least_m = (1.0 - LIKE_RADIUS) * max(map(_mean_radius_m, pairs))
        largest = [pair for pair in pairs if _mean_radius_m(pair) > least_m]
        joints = _quoted(dict.fromkeys(joint for pair in largest for joint in joints_of(pair)))
        if any(not _are_parallel(pair[0], largest[0][0]) for pair in largest):
            raise self._refused(OMNIDIRECTIONAL, f'the axles of {joints} point in different directions')
        if len(largest) > 1:
            raise self._refused(SKID_STEER, f'wheels of one size: {joints}')
        return pairs

    def _refused(self, kind: str, reason: str) -> ConfigError:
        """Return the error for a robot without two known driven wheels; it names those of a pair if there is one."""
        pairs = _coaxial_pairs(self._wheels)
        left, right = joints_of(max(pairs, key=_mean_radius_m)) if pairs else ('LEFT_JOINT', 'RIGHT_JOINT')
        mine = robot_file_line(self._tree.where, set={'simulator.left_joint': left, 'simulator.right_joint': right})
        allowed = f'two driven wheels on one axle; to name them: {mine}'
        return ConfigError(f'{self._tree.where}: given {kind} ({reason}); allowed: {allowed}')
