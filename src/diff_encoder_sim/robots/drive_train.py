"""The two driven wheels with their sizes, and where they stand."""

from __future__ import annotations

from typing import NamedTuple, Tuple

from diff_encoder_sim.robots.coaxial_pairs import WheelPair
from diff_encoder_sim.robots.controller_tags import controllers
from diff_encoder_sim.robots.drive_wheels import choose_wheels
from diff_encoder_sim.robots.findings import Findings
from diff_encoder_sim.robots.gazebo_tags import DriveTags, drive_plugins
from diff_encoder_sim.robots.ground_contacts import WheelBase
from diff_encoder_sim.robots.robot_choices import RobotChoices
from diff_encoder_sim.robots.robot_description import DriveWheel
from diff_encoder_sim.robots.robot_tree import RobotTree
from diff_encoder_sim.robots.rolling_wheels import RollingWheel, rolling_wheels
from diff_encoder_sim.robots.wheel_geometry import WheelGeometry, wheel_geometry

CENTRED_M = 5e-4


class DriveTrain(NamedTuple):
    """What drives the robot."""

    pair: WheelPair  # as the file has it
    geometry: WheelGeometry  # nominal
    left: DriveWheel
    right: DriveWheel
    base: WheelBase
    drives: Tuple[DriveTags, ...]  # plugins and controllers, those of these wheels


def find_drive(tree: RobotTree, choices: RobotChoices, seen: Findings) -> DriveTrain:
    """Return the drive of a robot whose meshes are replaced.

    Raises:
        ConfigError: the robot has no two driven wheels on one axle, or they have no size.
    """
    wheels = rolling_wheels(tree)
    drives = drive_plugins(tree, wheels) + controllers(tree, wheels)
    pair = choose_wheels(tree, wheels, drives, choices, seen)
    ours = tuple(tags for tags in drives if set(pair.joints) <= set(tags.left_joints + tags.right_joints))
    geometry = wheel_geometry(tree.where, pair, ours, choices, seen)
    left, right = _driven(pair.left, geometry, pair), _driven(pair.right, geometry, pair)
    base = _wheel_base(tree, left, right, geometry)
    place = f'x = {round(base.axle_x_m, 6) + 0.0:.4g} m, {1e3 * (base.floor_z_m + base.radius_m):.4g} mm up'
    seen.add('axle', place, 'wheels, in the base frame')
    _check_centred(left, right, seen)
    return DriveTrain(pair, geometry, left, right, base, ours)


def _driven(wheel: RollingWheel, geometry: WheelGeometry, pair: WheelPair) -> DriveWheel:
    """Return a driven wheel, moved along the axle to where the nominal separation has it."""
    middle_m = 0.5 * float(pair.left.centre_m[1] + pair.right.centre_m[1])
    x_m, _, z_m = wheel.centre_m.tolist()
    y_m = middle_m + (0.5 if wheel is pair.left else -0.5) * geometry.separation_m
    radius_m = wheel.radius_m or 0.5 * geometry.diameter_m
    return DriveWheel(wheel.joint, wheel.link, (x_m, y_m, z_m), radius_m, bool(wheel.axis[1] > 0.0))


def _wheel_base(tree: RobotTree, left: DriveWheel, right: DriveWheel, geometry: WheelGeometry) -> WheelBase:
    links = (*tree.subtree(left.link), *tree.subtree(right.link))
    middle_x_m, middle_z_m = (0.5 * (left.centre_m[axis] + right.centre_m[axis]) for axis in (0, 2))
    return WheelBase(middle_x_m, middle_z_m - 0.5 * geometry.diameter_m, 0.5 * geometry.diameter_m, links)


def _check_centred(left: DriveWheel, right: DriveWheel, seen: Findings) -> None:
    middle_m = 0.5 * (left.centre_m[1] + right.centre_m[1])
    if abs(middle_m) > CENTRED_M:
        side = 'left' if middle_m > 0.0 else 'right'
        seen.warn(
            f"the wheels' middle is {1e3 * abs(middle_m):.1f} mm to the {side} of the base frame's x axis: "
            'odometry, which takes it to be on it, errs by up to twice that in turns'
        )
