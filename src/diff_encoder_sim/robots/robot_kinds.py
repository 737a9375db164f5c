"""Robots that are no differential drive: what they are, what is modelled, and how to say otherwise."""

from __future__ import annotations

from typing import Iterable, List, Sequence, Tuple

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.coaxial_pairs import LIKE_RADIUS, PARALLEL, WheelPair, coaxial_pairs
from diff_encoder_sim.robots.gazebo_tags import OMNIDIRECTIONAL, SKID_STEER, STEERED, DriveTags, commanded_joints
from diff_encoder_sim.robots.robot_tree import RobotTree
from diff_encoder_sim.robots.rolling_wheels import RollingWheel, spins

ALLOWED = 'allowed: two driven wheels on one axle; name them as simulator.left_joint and simulator.right_joint'
OVERRIDE = 'to simulate two of its wheels as the drive, name them as simulator.left_joint and simulator.right_joint'
_MODELLED = 'modelled are two driven wheels on one axle'
_UNLIKE = {
    SKID_STEER: 'a robot with two or more driven axles (skid-steer), whose wheels slip sideways in each turn',
    STEERED: 'a robot with a steered wheel (tricycle or Ackermann)',
    OMNIDIRECTIONAL: 'an omnidirectional robot, whose wheels have rollers or which its plugin moves without wheels',
}


def unlike(where: str, kind: str, reason: str) -> ConfigError:
    """Return the error for a robot whose drive is not modelled."""
    return ConfigError(f'{where}: given {_UNLIKE[kind]} ({reason}); {_MODELLED}; {OVERRIDE}')


def check_plugins(tree: RobotTree, plugins: Iterable[DriveTags], wheels: Sequence[RollingWheel]) -> None:
    """Refuse what plugins tell to be no differential drive.

    Raises:
        ConfigError: the robot skids, steers or moves sideways.
    """
    for tags in plugins:
        # A plugin that moves the robot by itself needs no wheels, and is used for any robot.
        moves_any = tags.kind == OMNIDIRECTIONAL and not tags.left_joints and len(coaxial_pairs(wheels)) == 1
        if tags.kind in _UNLIKE and not moves_any:
            raise unlike(tree.where, tags.kind, f'plugin {tags.source}{_named(tags.left_joints + tags.right_joints)}')


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


def check_count(tree: RobotTree, wheels: Sequence[RollingWheel]) -> None:
    """Refuse what has not one pair of fixed wheels, by their number and places.

    Raises:
        ConfigError: the robot has no wheels, one, three on an axle, four to skid on, or wheels that roll sideways.
    """
    names = ', '.join(repr(wheel.joint) for wheel in wheels)
    if not wheels:
        raise ConfigError(f'{tree.where}: given a robot without wheels: {_joints(tree)}; {ALLOWED}')
    if len(wheels) == 1:
        raise ConfigError(f'{tree.where}: given one wheel, joint {names}; {ALLOWED}')
    if any(abs(wheel.axis @ wheels[0].axis) < PARALLEL for wheel in wheels[1:]) and len(wheels) > 2:
        raise unlike(tree.where, OMNIDIRECTIONAL, f'the axles of {names} point in different directions')
    pairs = coaxial_pairs(wheels)
    if not pairs:
        raise ConfigError(f'{tree.where}: given wheels that are not on one axle or not of one size: {names}; {ALLOWED}')
    for pair in pairs:
        third = next((other for other in pairs if _share_one(pair.joints, other.joints)), None)
        if third is not None:
            joints = ', '.join(map(repr, dict.fromkeys(pair.joints + third.joints)))
            raise ConfigError(f'{tree.where}: given three or more wheels on one axle: {joints}; {ALLOWED}')


def check_axles(tree: RobotTree, pairs: Sequence[WheelPair]) -> None:
    """Refuse two or more axles with wheels of one size.

    Raises:
        ConfigError: the robot skids.
    """
    radii_m = [pair.radius_m for pair in pairs]
    if len(pairs) > 1 and max(radii_m) - min(radii_m) <= LIKE_RADIUS * max(radii_m):
        names = ', '.join(repr(joint) for pair in pairs for joint in pair.joints)
        raise unlike(tree.where, SKID_STEER, f'wheels of one size: {names}')


def _share_one(a: List[str], b: List[str]) -> bool:
    return len(set(a) & set(b)) == 1


def _named(joints: Tuple[str, ...]) -> str:
    return f' with {", ".join(map(repr, joints))}' if joints else ''


def _joints(tree: RobotTree) -> str:
    """Return what the robot has in place of wheels."""
    turning = [joint.name for joint in tree.joints.values() if spins(tree, joint)]
    if turning:
        shown = ', '.join(map(repr, turning[:4])) + (' ...' if len(turning) > 4 else '')
        return f'of its joints that turn without end ({shown}) none has a level axis and a round shape near the floor'
    return f'none of its {len(tree.joints)} joints is continuous'
