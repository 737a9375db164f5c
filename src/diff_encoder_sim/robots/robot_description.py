"""What is known of a robot: found in its files, overridden by its user, each value with its source.

Made by describing.describe. Lengths in m in the root link's frame, joints at zero, unless a name says otherwise.
"""

from __future__ import annotations

from typing import Any, Dict, NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.base.xml_values import Vector
from diff_encoder_sim.robots.robot_tree import RobotTree, Shape

OutlineXy = Tuple[Tuple[float, float], ...]


class Found(NamedTuple):
    """A value and where it comes from, for the table that users read."""

    quantity: str  # such as 'wheel diameter [m]'
    value: str
    source: str  # such as 'libgazebo_ros_diff_drive: wheelDiameter'


class DriveWheel(NamedTuple):
    """A driven wheel."""

    joint: str
    link: str
    centre_m: Vector  # of its rolling circle, in the root
    radius_m: float
    is_forward_positive: bool  # a positive joint speed drives forward; else the joint's axis points to the right


class GroundContact(NamedTuple):
    """A caster, ball, skid or hull edge on which the robot leans."""

    name: str
    point_m: Vector  # the lowest point, in the root


class RobotLaser(NamedTuple):
    """The scanner and what the URDF says of it."""

    link: str
    pose_in_root: np.ndarray  # (4, 4)
    settings: Dict[str, Any]  # keys of LidarParams: samples, angle_min, angle_span, range_min, range_max, noise, rate


class MassProperties(NamedTuple):
    """Mass of the robot or of a part of it, in the root's frame."""

    mass_kg: float
    com_m: np.ndarray  # (3,)
    inertia_kgm2: np.ndarray  # (3, 3), about the centre of mass


class RobotDescription(NamedTuple):
    """A differential-drive robot, ready for physics, odometry and navigation."""

    tree: RobotTree
    left: DriveWheel
    right: DriveWheel
    wheel_diameter_m: float  # nominal, of both: what odometry and controller assume
    wheel_separation_m: float  # between the contact points
    mass: MassProperties  # of all links
    contacts: Tuple[GroundContact, ...]
    hull: Tuple[Shape, ...]  # collision shapes of all but wheels and contacts, poses in the root, meshes replaced
    footprint: OutlineXy  # convex, counter-clockwise, wheels included
    laser: Optional[RobotLaser]
    drive_limits: Dict[str, float]  # keys of DriveParams that plugins and joint limits give
    found: Tuple[Found, ...]
    warnings: Tuple[str, ...]  # what is likely wrong in the URDF, one line each
    notes: Tuple[str, ...]  # what was frozen, replaced or ignored, one line each

    @property
    def axle_x_m(self) -> float:
        """Return the axle's x in the root link."""
        return 0.5 * (self.left.centre_m[0] + self.right.centre_m[0])

    @property
    def floor_z_m(self) -> float:
        """Return the floor's z in the root link: where the wheels touch it."""
        return 0.5 * (self.left.centre_m[2] + self.right.centre_m[2]) - 0.5 * self.wheel_diameter_m
