"""The wheels of a robot, and which two drive it: by the user, by plugins, by transmissions, by geometry.

A wheel is a link that turns without end about a level axis and has a shape that rolls.
"""

from __future__ import annotations

import re
from itertools import combinations
from typing import FrozenSet, Iterable, List, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import did_you_mean
from diff_encoder_sim.robots.description import DrivenWheel, Findings, Joint, RobotChoices, RobotTree
from diff_encoder_sim.robots.drive_tags import (
    DIFFERENTIAL,
    OMNIDIRECTIONAL,
    SKID_STEER,
    STEERED,
    DriveTags,
    commanded_joints,
)
from diff_encoder_sim.robots.robot_file import robot_file_line
from diff_encoder_sim.robots.solids import placed, rolling_radius_m, vector

LEVEL = 0.17  # an axis' vertical part (10 degrees), below which a wheel can stand on it
SAME_RADIUS = 0.01  # shapes of one wheel: twin tyres, a tyre and its rim
PASSIVE = re.compile('caster|castor|idler|passive|support|roller|ball', re.IGNORECASE)
NEAR_FLOOR = 0.35  # of its radius: how far above the lowest wheel a wheel may end

PARALLEL = 0.995  # cosine
OFF_LINE = 0.1  # of the radius: how far a wheel may be off the other's axis
LIKE_RADIUS = 0.05
LEAST_SEPARATION = 0.2  # of the radius
LEAST_ACROSS = 0.985  # y part of an axle that lies across the robot (10 degrees)

_UNLIKE = {
    SKID_STEER: 'a robot with two or more driven axles (skid-steer, or mecanum), whose wheels slip in each turn',
    STEERED: 'a robot with a steered wheel (tricycle or Ackermann)',
    OMNIDIRECTIONAL: 'an omnidirectional robot, whose wheels have rollers',
}

WheelPair = Tuple[DrivenWheel, DrivenWheel]  # left, right


def rolling_wheels(tree: RobotTree) -> Tuple[DrivenWheel, ...]:
    """Return the wheels near the floor, in the file's order: none of an arm, no spinning scanner."""
    found = [wheel_of(tree, joint) for joint in tree.joints.values() if joint.spins]
    level = [wheel for wheel in found if wheel.radius_m and abs(wheel.axis[2]) < LEVEL]
    bottoms_m = [wheel.centre_m[2] - (wheel.radius_m or 0.0) for wheel in level]
    heights_m = [bottom_m - min(bottoms_m) for bottom_m in bottoms_m]
    return tuple(wheel for wheel, up_m in zip(level, heights_m) if up_m < NEAR_FLOOR * (wheel.radius_m or 0.0))


def wheel_of(tree: RobotTree, joint: Joint) -> DrivenWheel:
    """Return the wheel that a joint turns, by the largest of its shapes that roll; collision shapes first."""
    pose = tree.poses[joint.child]
    to_wheel = np.linalg.inv(pose)
    parts = [(tree.links[name], to_wheel @ tree.poses[name]) for name in tree.subtree(joint.child, is_rigid=True)]
    shapes = {
        'collision': [placed(shape, at) for link, at in parts for shape in link.collisions],
        'visual': [placed(shape, at) for link, at in parts for shape in link.visuals],
    }
    radius_m, centre_m, source = None, np.zeros(3), 'no rolling shape'
    for kind in ('visual', 'collision'):
        radii = [(rolling_radius_m(shape, joint.axis) or 0.0, shape) for shape in shapes[kind]]
        largest_m = max((radius for radius, _ in radii), default=0.0)
        if largest_m > 0.0:
            largest = [shape for radius, shape in radii if radius > (1.0 - SAME_RADIUS) * largest_m]
            radius_m, centre_m = largest_m, np.mean([shape.pose_in_link[:3, 3] for shape in largest], axis=0)
            source = f'{kind} {type(largest[0].geometry).__name__.lower()}'
    swivel = tree.swivel_above(joint.parent)
    centre_in_root_m, axis = vector(pose[:3, :3] @ centre_m + pose[:3, 3]), vector(tree.axis_in_root(joint))
    return DrivenWheel(joint.name, joint.child, centre_in_root_m, axis, radius_m, source, swivel and swivel.name)


def drivable_joints(tree: RobotTree, wheels: Sequence[DrivenWheel]) -> FrozenSet[str]:
    """Return the joints that can drive the robot: those of wheels that neither swivel nor are casters.

    Without two of these (wheels may lack a round shape) all joints count that spin about a level axis.
    """
    fixed = frozenset(wheel.joint for wheel in _without_casters(wheels))
    if len(fixed) > 1:
        return fixed
    spinning = (joint for joint in tree.joints.values() if joint.spins)
    return frozenset(joint.name for joint in spinning if abs(tree.axis_in_root(joint)[2]) < LEVEL)


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
    return 0.5 * ((pair[0].radius_m or 0.0) + (pair[1].radius_m or 0.0))


def _are_parallel(a: DrivenWheel, b: DrivenWheel) -> bool:
    return bool(abs(np.dot(a.axis, b.axis)) > PARALLEL)


def _are_coaxial(a: DrivenWheel, b: DrivenWheel) -> bool:
    """Return whether two wheels have one axis and one radius, side by side."""
    apart_m, larger_m = np.subtract(b.centre_m, a.centre_m), max(a.radius_m or 0.0, b.radius_m or 0.0)
    return bool(
        _are_parallel(a, b)
        and np.linalg.norm(np.cross(apart_m, a.axis)) < OFF_LINE * larger_m
        and abs(apart_m @ a.axis) > LEAST_SEPARATION * larger_m
        and abs((a.radius_m or 0.0) - (b.radius_m or 0.0)) <= LIKE_RADIUS * larger_m
    )


def _are_alike(other: WheelPair, pair: WheelPair) -> bool:
    return abs(_mean_radius_m(other) - _mean_radius_m(pair)) <= LIKE_RADIUS * _mean_radius_m(pair)


def choose_wheels(
    tree: RobotTree, wheels: Sequence[DrivenWheel], drives: Sequence[DriveTags], choices: RobotChoices, seen: Findings
) -> WheelPair:
    """Return the two driven wheels of a robot whose meshes are replaced; the source is added to the table.

    Raises:
        ConfigError: the robot is no differential drive, or the choice is no pair of wheels.
    """
    pair, source = (
        _chosen(tree, wheels, choices)
        or _by_plugin(tree, wheels, drives, seen)
        or _by_evidence(tree, wheels, drives, seen)
    )
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
    others = [each for each in wheels if each.joint not in joints_of(pair) and each.swivel is None]
    like = [each.joint for each in others if _are_alike((each, each), pair)]
    if like:
        seen.warn(f'the wheels of {_quoted(like)} slide without friction: what they do in turns is not modelled')
    return pair


def _chosen(tree: RobotTree, wheels: Sequence[DrivenWheel], choices: RobotChoices) -> Optional[Tuple[WheelPair, str]]:
    """Return the user's pair; if only one is given, with the wheel on its axle."""
    given: List[Optional[DrivenWheel]] = []
    for side, name in (('left', choices.left_joint), ('right', choices.right_joint)):
        joint = tree.joints.get(name or '')
        if name and (joint is None or joint.kind not in ('continuous', 'revolute')):
            fault = f'{name!r} as {side} wheel joint, which is {joint.kind if joint else "missing"}'
            known = ', '.join(each.name for each in tree.joints.values() if each.spins)
            hint = '' if joint else did_you_mean(name, tree.joints)
            raise ConfigError(f'{tree.where}: given {fault}; allowed: one that turns without end: {known}{hint}')
        given.append(joint and wheel_of(tree, joint))
    one = given[0] or given[1]
    if one is None:
        return None
    others = [wheel for wheel in wheels if wheel.joint != one.joint and _are_coaxial(wheel, one)]
    if None in given and len(others) != 1:
        raise ConfigError(f"{tree.where}: given joint {one.joint!r} alone; allowed: both of the driven wheels' joints")
    left, right = (each or others[0] for each in given)
    if left.centre_m[1] <= right.centre_m[1]:
        raise ConfigError(
            f'{tree.where}: given {left.joint!r} as left wheel at y = {left.centre_m[1]:.3f} m and {right.joint!r} as '
            f'right wheel at {right.centre_m[1]:.3f} m; allowed: the left wheel left of the right one, x forward'
        )
    return (left, right), 'given'


def _by_plugin(
    tree: RobotTree, wheels: Sequence[DrivenWheel], drives: Sequence[DriveTags], seen: Findings
) -> Optional[Tuple[WheelPair, str]]:
    """Return the pair of the first differential drive whose joints the robot has; of those by name first."""
    ours = [tags for tags in drives if tags.kind == DIFFERENTIAL]
    named = {frozenset(tags.left_joints + tags.right_joints) for tags in ours if tags.is_named}
    pairs = [pair for pair in named if pair <= set(tree.joints)]
    if len(pairs) > 1:
        raise _refused(tree, SKID_STEER, f'plugins with {_quoted(sorted(joint for pair in pairs for joint in pair))}')
    for tags in sorted(ours, key=lambda tags: not tags.is_named):
        left, right = tree.joints.get(tags.left_joints[0]), tree.joints.get(tags.right_joints[0])
        if left is None or right is None:
            missing = tags.left_joints[0] if left is None else tags.right_joints[0]
            seen.warn(f'{tags.source} names joint {missing!r}, which the robot does not have')
        elif left.name != right.name and left.spins and right.spins:
            pair = _left_first(wheel_of(tree, left), wheel_of(tree, right))
            _check_others_of_plugin(tree, pair, tags.is_named, wheels)
            if pair[0].joint != left.name:
                seen.warn(f'{tags.source} names {left.name!r} as left joint, which is on the right: taken as right one')
            return pair, tags.source
    return None


def _check_others_of_plugin(tree: RobotTree, pair: WheelPair, is_named: bool, wheels: Sequence[DrivenWheel]) -> None:
    """Refuse a pair of wheels which a plugin names, if others steer, or drive on another axle.

    If the name of the plugin is not one of differential drives, all wheels of the pair's size are driven; otherwise
    only those that are commanded, too.
    """
    _check_steering(tree, wheels, is_named)
    commanded = commanded_joints(tree)
    driven = [wheel for wheel in wheels if wheel.swivel is None and (not is_named or wheel.joint in commanded)]
    same = {pair[0].joint, *(wheel.joint for wheel in wheels if _are_coaxial(wheel, pair[0]))}
    others = [each for each in _coaxial_pairs(driven) if each[0].joint not in same]
    like = [each for each in others if _are_alike(each, pair)]
    if like:
        raise _refused(tree, SKID_STEER, f'wheels of one size: {_quoted([*joints_of(pair), *joints_of(like[0])])}')


def _check_steering(tree: RobotTree, wheels: Iterable[DrivenWheel], is_differential: bool = False) -> None:
    """Refuse a wheel on a swivel that is commanded, or that has limits if the file does not show what is commanded.

    If a plugin shows that the robot is a differential drive, only swivels commanded by position steer.
    """
    commanded = commanded_joints(tree, position=True) + (() if is_differential else commanded_joints(tree))
    for wheel in wheels:
        is_limited = wheel.swivel and not tree.joints[wheel.swivel].spins
        if wheel.swivel in commanded or (is_limited and not commanded and not is_differential):
            raise _refused(tree, STEERED, f'joint {wheel.swivel!r} turns wheel {wheel.link!r} about an upright axis')


def _by_evidence(
    tree: RobotTree, wheels: Sequence[DrivenWheel], drives: Sequence[DriveTags], seen: Findings
) -> Tuple[WheelPair, str]:
    """Return the pair that follows from transmissions, sizes and names, if no plugin names it."""
    for tags in drives:
        if tags.kind in _UNLIKE:
            joints = tags.left_joints + tags.right_joints
            raise _refused(tree, tags.kind, f'plugin {tags.source}' + (f' with {_quoted(joints)}' if joints else ''))
    _check_steering(tree, wheels)
    commanded = [wheel for wheel in wheels if wheel.joint in commanded_joints(tree) and not wheel.swivel]
    if len(commanded) == 2 and _are_coaxial(*commanded):
        return _left_first(*commanded), 'transmissions'
    driven = commanded if len(commanded) > 2 else wheels
    pairs = _pairs_on_one_axle(tree, _without_casters(driven))
    pair = max(pairs, key=_mean_radius_m)
    if len(pairs) > 1:
        others = _quoted(joint for other in pairs if other is not pair for joint in joints_of(other))
        largest = ' and '.join(map(repr, joints_of(pair)))
        seen.warn(f'the largest wheels, {largest}, are taken to be driven and {others} to be casters')
    return pair, 'transmissions and geometry' if driven is commanded else 'geometry'


def _pairs_on_one_axle(tree: RobotTree, wheels: Sequence[DrivenWheel]) -> List[WheelPair]:
    """Return the pairs of wheels on one axle; refuse a robot without one, or with several of the largest size."""
    pairs = _coaxial_pairs(wheels)
    if len(wheels) > 1 and not pairs and any(not _are_parallel(wheel, wheels[0]) for wheel in wheels):
        names = _quoted(wheel.joint for wheel in wheels)
        raise _refused(tree, OMNIDIRECTIONAL, f'the axles of {names} point in different directions')
    if not pairs:
        given = f'the wheels {_quoted(wheel.joint for wheel in wheels)}' if wheels else 'a robot without wheels'
        turning = _quoted(joint.name for joint in tree.joints.values() if joint.spins) or 'none'
        wanted = 'a level axis, a round shape near the floor, and one axle and size with another'
        reason = f'joints that turn without end: {turning}; a wheel has {wanted}'
        raise _refused(tree, given, reason)
    least_m = (1.0 - LIKE_RADIUS) * max(map(_mean_radius_m, pairs))
    largest = [pair for pair in pairs if _mean_radius_m(pair) > least_m]
    joints = _quoted(dict.fromkeys(joint for pair in largest for joint in joints_of(pair)))
    if any(not _are_parallel(pair[0], largest[0][0]) for pair in largest):
        raise _refused(tree, OMNIDIRECTIONAL, f'the axles of {joints} point in different directions')
    if len(largest) > 1:
        raise _refused(tree, SKID_STEER, f'wheels of one size: {joints}')
    return pairs


def _refused(tree: RobotTree, kind: str, reason: str) -> ConfigError:
    """Return the error for a robot without two known driven wheels; it names those of a pair if there is one."""
    pairs = _coaxial_pairs(rolling_wheels(tree))
    left, right = joints_of(max(pairs, key=_mean_radius_m)) if pairs else ('LEFT_JOINT', 'RIGHT_JOINT')
    mine = robot_file_line(tree.where, set={'simulator.left_joint': left, 'simulator.right_joint': right})
    allowed = f'two driven wheels on one axle; to name them: {mine}'
    return ConfigError(f'{tree.where}: given {_UNLIKE.get(kind, kind)} ({reason}); allowed: {allowed}')


def _quoted(names: Iterable[str]) -> str:
    return ', '.join(map(repr, names))
