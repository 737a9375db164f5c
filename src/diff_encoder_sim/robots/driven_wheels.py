"""Which two wheels drive: by the user, by plugins and controllers, by transmissions, by geometry."""

from __future__ import annotations

import re
from typing import Iterable, Optional, Sequence, Tuple

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import did_you_mean
from diff_encoder_sim.robots.description import DrivenWheel, Findings, RobotChoices, RobotTree
from diff_encoder_sim.robots.drive_tags import (
    DIFFERENTIAL,
    OMNIDIRECTIONAL,
    SKID_STEER,
    STEERED,
    DriveTags,
    commanded_joints,
)
from diff_encoder_sim.robots.robot_file import robot_file_line
from diff_encoder_sim.robots.rolling_wheels import (
    LIKE_RADIUS,
    WheelPair,
    are_coaxial,
    are_parallel,
    coaxial_pairs,
    joints_of,
    left_first,
    mean_radius_m,
    rolling_wheels,
    wheel_of,
    without_casters,
)

LEAST_ACROSS = 0.985  # y part of an axle that lies across the robot (10 degrees)
_MODELLED = 'modelled are two driven wheels on one axle'
_UNLIKE = {
    SKID_STEER: 'a robot with two or more driven axles (skid-steer, or mecanum), whose wheels slip in each turn',
    STEERED: 'a robot with a steered wheel (tricycle or Ackermann)',
    OMNIDIRECTIONAL: 'an omnidirectional robot, whose wheels have rollers',
}


def choose_wheels(
    tree: RobotTree, wheels: Sequence[DrivenWheel], drives: Sequence[DriveTags], choices: RobotChoices, seen: Findings
) -> WheelPair:
    """Return the two driven wheels; the source is added to the table.

    Args:
        tree: the robot, meshes replaced.
        wheels: from rolling_wheels.
        drives: from find_drive_tags.
        choices: the user's.
        seen: takes the table's rows and the warnings.

    Raises:
        ConfigError: the robot is no differential drive, or the choice is no pair of wheels.
    """
    pair, source = (
        _chosen(tree, wheels, choices)
        or _by_plugin(tree, wheels, drives, seen)
        or _by_evidence(tree, wheels, drives, seen)
    )
    _check_axle(tree, pair)
    for side, other, wheel in (('left', 'right', pair[0]), ('right', 'left', pair[1])):
        seen.add(f'{side} wheel joint', wheel.joint, source)
        if re.search(other, wheel.joint, re.IGNORECASE) and not re.search(side, wheel.joint, re.IGNORECASE):
            place = f'is the {side} wheel (y = {wheel.centre_m[1]:+.3f} m)'
            seen.warn(f"joint {wheel.joint!r} {place}: is x forward in the robot's root link?")
    # As large ones on another axle may be driven, too, and they resist turns.
    others = [each for each in wheels if each.joint not in joints_of(pair) and each.swivel is None]
    like = [each.joint for each in others if _is_like(each.radius_m or 0.0, mean_radius_m(pair))]
    if like:
        seen.warn(f'the wheels of {_quoted(like)} slide without friction: what they do in turns is not modelled')
    return pair


def _chosen(tree: RobotTree, wheels: Sequence[DrivenWheel], choices: RobotChoices) -> Optional[Tuple[WheelPair, str]]:
    """Return the user's pair; if only one is given, with the wheel on its axle."""
    given = [_users_wheel(tree, choices.left_joint, 'left'), _users_wheel(tree, choices.right_joint, 'right')]
    one = given[0] or given[1]
    if one is None:
        return None
    others = [wheel for wheel in wheels if wheel.joint != one.joint and are_coaxial(wheel, one)]
    if None in given and len(others) != 1:
        raise ConfigError(f"{tree.where}: given joint {one.joint!r} alone; allowed: both of the driven wheels' joints")
    left, right = (each or others[0] for each in given)
    if left.centre_m[1] <= right.centre_m[1]:
        raise ConfigError(
            f'{tree.where}: given {left.joint!r} as left wheel at y = {left.centre_m[1]:.3f} m and {right.joint!r} as '
            f'right wheel at {right.centre_m[1]:.3f} m; allowed: the left wheel left of the right one, x forward'
        )
    return (left, right), 'given'


def _users_wheel(tree: RobotTree, name: Optional[str], side: str) -> Optional[DrivenWheel]:
    if name is None:
        return None
    joint = tree.joints.get(name)
    given = f'{tree.where}: given {name!r} as {side} wheel joint, which is'
    if joint is None:
        known = ', '.join(tree.joints) or 'none, the robot has no joint'
        raise ConfigError(f'{given} missing; allowed: one of {known}{did_you_mean(name, tree.joints)}')
    if joint.kind not in ('continuous', 'revolute'):
        raise ConfigError(f'{given} {joint.kind}; allowed: continuous')
    return wheel_of(tree, joint)


def _by_plugin(
    tree: RobotTree, wheels: Sequence[DrivenWheel], drives: Sequence[DriveTags], seen: Findings
) -> Optional[Tuple[WheelPair, str]]:
    """Return the pair of the first differential drive whose joints the robot has; of those by name first."""
    ours = [tags for tags in drives if tags.kind == DIFFERENTIAL]
    named = {frozenset(tags.left_joints + tags.right_joints) for tags in ours if tags.is_named}
    pairs = [pair for pair in named if pair <= set(tree.joints)]
    if len(pairs) > 1:
        raise _unlike(tree, SKID_STEER, f'plugins with {_quoted(sorted(joint for pair in pairs for joint in pair))}')
    for tags in sorted(ours, key=lambda tags: not tags.is_named):
        left, right = tree.joints.get(tags.left_joints[0]), tree.joints.get(tags.right_joints[0])
        if left is None or right is None:
            missing = tags.left_joints[0] if left is None else tags.right_joints[0]
            seen.warn(f'{tags.source} names joint {missing!r}, which the robot does not have')
        elif left.name != right.name and left.spins and right.spins:
            pair = left_first(wheel_of(tree, left), wheel_of(tree, right))
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
    same = {pair[0].joint, *(wheel.joint for wheel in wheels if are_coaxial(wheel, pair[0]))}
    others = [each for each in coaxial_pairs(driven) if each[0].joint not in same]
    like = [each for each in others if _is_like(mean_radius_m(each), mean_radius_m(pair))]
    if like:
        raise _unlike(tree, SKID_STEER, f'wheels of one size: {_quoted([*joints_of(pair), *joints_of(like[0])])}')


def _check_steering(tree: RobotTree, wheels: Iterable[DrivenWheel], is_differential: bool = False) -> None:
    """Refuse a wheel on a swivel that is commanded, or that has limits if the file does not show what is commanded.

    If a plugin shows that the robot is a differential drive, only swivels commanded by position steer.
    """
    commanded = commanded_joints(tree, position=True) + (() if is_differential else commanded_joints(tree))
    for wheel in wheels:
        is_limited = wheel.swivel and not tree.joints[wheel.swivel].spins
        if wheel.swivel in commanded or (is_limited and not commanded and not is_differential):
            raise _unlike(tree, STEERED, f'joint {wheel.swivel!r} turns wheel {wheel.link!r} about an upright axis')


def _by_evidence(
    tree: RobotTree, wheels: Sequence[DrivenWheel], drives: Sequence[DriveTags], seen: Findings
) -> Tuple[WheelPair, str]:
    """Return the pair that follows from transmissions, sizes and names, if no plugin names it."""
    for tags in drives:
        if tags.kind in _UNLIKE:
            joints = tags.left_joints + tags.right_joints
            raise _unlike(tree, tags.kind, f'plugin {tags.source}' + (f' with {_quoted(joints)}' if joints else ''))
    _check_steering(tree, wheels)
    commanded = [wheel for wheel in wheels if wheel.joint in commanded_joints(tree) and not wheel.swivel]
    if len(commanded) == 2 and are_coaxial(*commanded):
        return left_first(*commanded), 'transmissions'
    driven = commanded if len(commanded) > 2 else wheels
    fixed = without_casters([wheel for wheel in driven if not wheel.swivel])
    _check_number_and_places(tree, fixed)
    pairs = coaxial_pairs(fixed)
    pair = max(pairs, key=mean_radius_m)
    if len(pairs) > 1:
        others = _quoted(joint for other in pairs if other is not pair for joint in joints_of(other))
        largest = ' and '.join(map(repr, joints_of(pair)))
        seen.warn(f'the largest wheels, {largest}, are taken to be driven and {others} to be casters')
    return pair, 'transmissions and geometry' if driven is commanded else 'geometry'


def _check_number_and_places(tree: RobotTree, wheels: Sequence[DrivenWheel]) -> None:
    """Refuse a robot without two wheels on one axle, or with others like them."""
    names, pairs = _quoted(wheel.joint for wheel in wheels), coaxial_pairs(wheels)
    if not wheels:
        turning = [joint.name for joint in tree.joints.values() if joint.spins]
        reason = f'none of its {len(tree.joints)} joints is continuous'
        if turning:
            shown = _quoted(turning[:4]) + (' ...' if len(turning) > 4 else '')
            reason = f'of its joints that turn without end ({shown}) none has a level axis and a round shape near the '
            reason += 'floor'
        raise _no_pair(tree, f'a robot without wheels: {reason}')
    if len(wheels) == 1:
        raise _no_pair(tree, f'one wheel, joint {names}')
    if not pairs and any(not are_parallel(wheel, wheels[0]) for wheel in wheels):
        raise _unlike(tree, OMNIDIRECTIONAL, f'the axles of {names} point in different directions')
    if not pairs:
        raise _no_pair(tree, f'wheels that are not on one axle or not of one size: {names}')
    largest_m = max(map(mean_radius_m, pairs))
    pairs = [pair for pair in pairs if mean_radius_m(pair) > (1.0 - LIKE_RADIUS) * largest_m]
    joints = list(dict.fromkeys(joint for pair in pairs for joint in joints_of(pair)))
    if len(pairs) == 1:
        return
    if len(joints) < 2 * len(pairs):
        raise _no_pair(tree, f'three or more wheels on one axle: {_quoted(joints)}')
    if any(not are_parallel(pair[0], pairs[0][0]) for pair in pairs):
        raise _unlike(tree, OMNIDIRECTIONAL, f'the axles of {_quoted(joints)} point in different directions')
    raise _unlike(tree, SKID_STEER, f'wheels of one size: {_quoted(joints)}')


def _check_axle(tree: RobotTree, pair: WheelPair) -> None:
    """Refuse an axle that does not lie across the robot."""
    x_m, y_m, z_m = (left - right for left, right in zip(pair[0].centre_m, pair[1].centre_m))
    if y_m <= 0.0 or abs(y_m) < LEAST_ACROSS * (x_m**2 + y_m**2 + z_m**2) ** 0.5:
        names = f'joints {pair[0].joint!r} and {pair[1].joint!r}'
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


def _unlike(tree: RobotTree, kind: str, reason: str) -> ConfigError:
    """Return the error for a robot whose drive is not modelled."""
    override = f'to simulate two of its wheels as the drive: {_chosen_wheels(tree)}'
    return ConfigError(f'{tree.where}: given {_UNLIKE[kind]} ({reason}); {_MODELLED}; {override}')


def _no_pair(tree: RobotTree, given: str) -> ConfigError:
    """Return the error for a robot without two wheels that are known to drive."""
    return ConfigError(
        f'{tree.where}: given {given}; allowed: two driven wheels on one axle; to name them: {_chosen_wheels(tree)}'
    )


def _chosen_wheels(tree: RobotTree) -> str:
    """Return the robot file that names two wheels, with those of a pair if there is one."""
    pairs = coaxial_pairs(rolling_wheels(tree))
    left, right = joints_of(max(pairs, key=mean_radius_m)) if pairs else ('LEFT_JOINT', 'RIGHT_JOINT')
    return robot_file_line(tree.where, set={'simulator.left_joint': left, 'simulator.right_joint': right})


def _is_like(a_m: float, b_m: float) -> bool:
    return abs(a_m - b_m) <= LIKE_RADIUS * b_m


def _quoted(names: Iterable[str]) -> str:
    return ', '.join(map(repr, names))
