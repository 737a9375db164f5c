"""Which two wheels drive: by the user, by plugins and controllers, by transmissions, by geometry and names."""

from __future__ import annotations

import re
from typing import Optional, Sequence, Tuple

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.typed_params import did_you_mean
from diff_encoder_sim.robots.coaxial_pairs import LIKE_RADIUS, WheelPair, are_coaxial, coaxial_pairs, left_first
from diff_encoder_sim.robots.findings import Findings
from diff_encoder_sim.robots.gazebo_tags import DIFFERENTIAL, DriveTags, commanded_joints
from diff_encoder_sim.robots.robot_choices import RobotChoices
from diff_encoder_sim.robots.robot_kinds import check_one_pair, check_pair, check_plugins, check_steering, check_wheels
from diff_encoder_sim.robots.robot_tree import RobotTree
from diff_encoder_sim.robots.rolling_wheels import RollingWheel, spins, wheel_of, without_casters

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
