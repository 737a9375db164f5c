"""What carries the part of a robot's weight that its driven wheels do not: one support before, one behind the axle."""

from __future__ import annotations

from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.robots.robot_description import GroundContact, RobotDescription
from diff_encoder_sim.robots.robot_tree import Shape, Sphere

# A contact that is closer to the axle cannot keep a robot from tipping. Of the wheel's radius.
_SHORTEST_ARM = 0.1
# How far the support on the light side hangs above the floor, of its distance from the axle: a robot that tips over
# onto it leans by 0.06 degrees, whatever its size. With both down, they and not the wheels might carry it. With 0.01 a
# robot balanced on its axle rocks by 0.6 degrees, by which its base frame 0.1 m above the axle is 0.1 % of a metre off.
_CLEARANCE = 0.001
_GAP_DECIMALS = 3  # of m: contacts within a millimetre are on the floor together
_SUPPORT_RADIUS = 0.5  # of the wheel's; any ball touches a floor in one point


class _Arm(NamedTuple):
    """A contact as a lever about the axle."""

    length_m: float
    y_m: float
    gap_m: float  # to the floor


def support_balls(description: RobotDescription) -> Tuple[Shape, Shape]:
    """Return the balls on which the robot leans, in the root: before and behind the axle.

    The one on the centre of mass's side touches the floor, so that the robot stands level and on three points.
    """
    front = _support(description, 1.0, description.mass.com_m[0] >= description.axle_x_m)
    rear = _support(description, -1.0, description.mass.com_m[0] < description.axle_x_m)
    return front, rear


def _support(description: RobotDescription, side: float, is_down: bool) -> Shape:
    arm_m, y_m = _place(description, side)
    radius_m = _SUPPORT_RADIUS * 0.5 * description.wheel_diameter_m
    pose = np.eye(4)
    pose[:3, 3] = (
        description.axle_x_m + side * arm_m,
        y_m,
        description.floor_z_m + radius_m + (0.0 if is_down else _CLEARANCE * arm_m),
    )
    return Shape(Sphere(radius_m), pose)


def _place(description: RobotDescription, side: float) -> Tuple[float, float]:
    """Return the support's distance from the axle [m] and its y [m].

    It is where the lowest contact of this side is, of several the outermost; without any, at the footprint's end.
    Contacts side by side share the load so that its middle is below the centre of mass.
    """
    com_y_m = float(description.mass.com_m[1])
    arms = [_arm(description, contact, side) for contact in description.contacts]
    reaching = [arm for arm in arms if arm.length_m > _SHORTEST_ARM * 0.5 * description.wheel_diameter_m]
    if not reaching:
        end_m = max(side * (x_m - description.axle_x_m) for x_m, _ in description.footprint)
        return max(end_m, 0.5 * description.wheel_diameter_m), com_y_m
    lowest_m = min(arm.gap_m for arm in reaching)
    lowest = [arm for arm in reaching if arm.gap_m == lowest_m]
    across_m = [arm.y_m for arm in lowest]
    return max(arm.length_m for arm in lowest), min(max(com_y_m, min(across_m)), max(across_m))


def _arm(description: RobotDescription, contact: GroundContact, side: float) -> _Arm:
    x_m, y_m, z_m = contact.point_m
    gap_m = round(z_m - description.floor_z_m, _GAP_DECIMALS)
    return _Arm(side * (x_m - description.axle_x_m), y_m, gap_m)
