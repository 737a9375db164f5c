"""Robots that are no differential drive: what they are, what is modelled, and how to say otherwise."""

from __future__ import annotations

from typing import Iterable, Sequence, Tuple

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.coaxial_pairs import LIKE_RADIUS, WheelPair, are_parallel, coaxial_pairs
from diff_encoder_sim.robots.gazebo_tags import (
    DIFFERENTIAL,
    OMNIDIRECTIONAL,
    SKID_STEER,
    STEERED,
    DriveTags,
    commanded_joints,
)
from diff_encoder_sim.robots.robot_tree import RobotTree
from diff_encoder_sim.robots.rolling_wheels import RollingWheel, spins

ALLOWED = 'allowed: two driven wheels on one axle; name them as simulator.left_joint and simulator.right_joint'
OVERRIDE = 'to simulate two of its wheels as the drive, name them as simulator.left_joint and simulator.right_joint'
_MODELLED = 'modelled are two driven wheels on one axle'
_UNLIKE = {
    SKID_STEER: 'a robot with two or more driven axles (skid-steer, or mecanum), whose wheels slip in each turn',
    STEERED: 'a robot with a steered wheel (tricycle or Ackermann)',
    OMNIDIRECTIONAL: 'an omnidirectional robot, whose wheels have rollers or which its plugin moves without wheels',
}


def unlike(where: str, kind: str, reason: str) -> ConfigError:
    """Return the error for a robot whose drive is not modelled."""
    return ConfigError(f'{where}: given {_UNLIKE[kind]} ({reason}); {_MODELLED}; {OVERRIDE}')


def check_plugins(tree: RobotTree, plugins: Iterable[DriveTags], wheels: Sequence[RollingWheel]) -> None:
    """Refuse what plugins say is no differential drive, where none is one.

    Raises:
        ConfigError: the robot skids, steers or moves sideways.
    """
    for tags in plugins:
        # A plugin that moves the robot by itself needs no wheels, and is used for any robot.
        moves_any = tags.kind == OMNIDIRECTIONAL and not tags.left_joints and len(coaxial_pairs(wheels)) == 1
        if tags.kind in _UNLIKE and not moves_any:
            raise unlike(tree.where, tags.kind, f'plugin {tags.source}{_named(tags.left_joints + tags.right_joints)}')


def check_one_pair(tree: RobotTree, plugins: Iterable[DriveTags]) -> None:
    """Refuse plugins that drive a pair of wheels each.

    Raises:
        ConfigError: the robot skids.
    """
    pairs = {frozenset(tags.left_joints + tags.right_joints) for tags in plugins if tags.kind == DIFFERENTIAL}
    driven = [pair for pair in pairs if pair <= set(tree.joints)]
    if len(driven) > 1:
        names = tuple(sorted(joint for pair in driven for joint in pair))
        raise unlike(tree.where, SKID_STEER, f'plugins{_named(names)}')


def check_steering(tree: RobotTree, wheels: Iterable[RollingWheel]) -> None:
    """Refuse a wheel on a swivel that is commanded, or that has limits where nothing is known to be commanded.

    Raises:
        ConfigError: the robot steers.
    """
    commanded = commanded_joints(tree) + commanded_joints(tree, position=True)
    for wheel in wheels:
        is_limited = not commanded and wheel.swivel and not spins(tree, tree.joints[wheel.swivel])
        if wheel.swivel in commanded or is_limited:
            raise unlike(
                tree.where, STEERED, f'joint {wheel.swivel!r} turns wheel {wheel.link!r} about an upright axis'
            )


def check_wheels(tree: RobotTree, wheels: Sequence[RollingWheel]) -> None:
    """Refuse what has not two wheels on one axle, and no others like them, by their number and places.

    Raises:
        ConfigError: the robot has no wheels, one, three on an axle, four to skid on, or wheels that roll sideways.
    """
    names, pairs = _quoted(wheel.joint for wheel in wheels), coaxial_pairs(wheels)
    if not wheels:
        raise ConfigError(f'{tree.where}: given a robot without wheels: {_joints(tree)}; {ALLOWED}')
    if len(wheels) == 1:
        raise ConfigError(f'{tree.where}: given one wheel, joint {names}; {ALLOWED}')
    if not pairs and any(not are_parallel(wheel, wheels[0]) for wheel in wheels):
        raise unlike(tree.where, OMNIDIRECTIONAL, f'the axles of {names} point in different directions')
    if not pairs:
        raise ConfigError(f'{tree.where}: given wheels that are not on one axle or not of one size: {names}; {ALLOWED}')
    _check_axles(tree, [pair for pair in pairs if pair.radius_m > (1.0 - LIKE_RADIUS) * _largest(pairs).radius_m])


def _check_axles(tree: RobotTree, pairs: Sequence[WheelPair]) -> None:
    """Refuse more than one pair of wheels of one size."""
    if len(pairs) < 2:
        return
    joints = list(dict.fromkeys(joint for pair in pairs for joint in pair.joints))
    if len(joints) < 2 * len(pairs):
        raise ConfigError(f'{tree.where}: given three or more wheels on one axle: {_quoted(joints)}; {ALLOWED}')
    if any(not are_parallel(pair.left, pairs[0].left) for pair in pairs):
        raise unlike(tree.where, OMNIDIRECTIONAL, f'the axles of {_quoted(joints)} point in different directions')
    raise unlike(tree.where, SKID_STEER, f'wheels of one size: {_quoted(joints)}')


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
