"""Errors for robots that are no differential drive: their kind, and the robot file that overrides it."""

from __future__ import annotations

from typing import Iterable, Sequence, Tuple

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.coaxial_pairs import LIKE_RADIUS, WheelPair, are_coaxial, are_parallel, coaxial_pairs
from diff_encoder_sim.robots.gazebo_tags import (
    DIFFERENTIAL,
    OMNIDIRECTIONAL,
    SKID_STEER,
    STEERED,
    DriveTags,
    commanded_joints,
)
from diff_encoder_sim.robots.robot_file import robot_file_line
from diff_encoder_sim.robots.robot_tree import RobotTree
from diff_encoder_sim.robots.rolling_wheels import RollingWheel, rolling_wheels, spins

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
        raise _no_pair(tree, f'a robot without wheels: {_joints(tree)}')
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


def _joints(tree: RobotTree) -> str:
    """Return what the robot has in place of wheels."""
    turning = [joint.name for joint in tree.joints.values() if spins(tree, joint)]
    if turning:
        shown = _quoted(turning[:4]) + (' ...' if len(turning) > 4 else '')
        return f'of its joints that turn without end ({shown}) none has a level axis and a round shape near the floor'
    return f'none of its {len(tree.joints)} joints is continuous'
