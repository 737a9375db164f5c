"""A robot: its source, the tree of links in its URDF, and the description that follows from it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple
from xml.etree import ElementTree

import numpy as np
import yaml

from diff_encoder_sim.base.bounds import Length_m
from diff_encoder_sim.base.params import Params, param
from diff_encoder_sim.base.per_wheel import WheelDiameterOrZero_m
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.xml_values import Vector
from diff_encoder_sim.robots.solids import MassProperties, Shape

UPRIGHT = 0.9  # an axis' vertical part, above which a joint swivels


class AddedLaser(NamedTuple):
    """A level scanner on a link of the robot."""

    parent: str  # link
    xyz_m: Tuple[float, ...]  # (x, y, z) in the parent

    def place(self) -> Dict[str, Any]:
        """Return the entry of a robot file."""
        return {'parent': self.parent, 'xyz': list(self.xyz_m)}


def robot_file_line(urdf: str, **content: Any) -> str:
    """Return the content of a robot file in one line of YAML, for messages that propose one."""
    text = yaml.safe_dump(
        {'urdf': urdf, **content}, default_flow_style=True, sort_keys=False, width=math.inf, allow_unicode=True
    )
    return f'a robot file (YAML): {text.strip()}'


class RobotSource(NamedTuple):
    """A robot's description as users name it: hashable, so that everything derived from it can be cached."""

    file: Path  # xacro or URDF
    arguments: Tuple[Tuple[str, str], ...] = ()  # (name, value) of xacro:arg, in any order
    package_folders: Tuple[Path, ...] = ()  # packages, or folders that hold some
    added_laser: Optional[AddedLaser] = None  # None: the scanner is the URDF's


class RobotChoices(Params):
    """A user's overrides of the description; None: as in the robot's file."""

    left_joint: Optional[str] = param(None, 'of the left wheel')
    right_joint: Optional[str] = param(None, 'of the right wheel')
    laser_link: Optional[str] = param(None, 'link of the scanner')
    wheel_diameter: WheelDiameterOrZero_m = param(0.0, 'nominal [m]; 0: as in the file')
    wheel_separation: Optional[Length_m] = param(None, 'between the contact points [m]')


class Link(NamedTuple):
    """A rigid part."""

    name: str
    inertial: Optional[MassProperties]
    collisions: Tuple[Shape, ...]
    visuals: Tuple[Shape, ...]
    friction: Optional[float]  # of <contact><lateral_friction>, PyBullet's tag; None if it is not given


class Joint(NamedTuple):
    """The connection of a link to its parent."""

    name: str
    kind: str  # fixed, continuous, revolute, prismatic, floating, planar
    parent: str
    child: str
    child_in_parent: np.ndarray  # (4, 4), at zero
    axis: np.ndarray  # (3,) unit vector in the child's frame
    effort: Optional[float]  # limit [N m], None if there is none
    speed: Optional[float]  # limit [rad/s]
    is_mimic: bool
    spins: bool  # turns without end: continuous, or revolute with limits of a turn or more


@dataclass(frozen=True, eq=False)
class RobotTree:
    """A robot as its URDF describes it: a tree of links below one root link."""

    name: str
    root: str  # the root link's name: the robot's base frame
    links: Dict[str, Link]
    joints: Dict[str, Joint]  # by the joint's name
    xml: ElementTree.Element  # <robot>: for <gazebo>, <transmission> and <ros2_control>
    where: str  # the robot's file, which begins each error
    notes: Tuple[str, ...] = ()  # what was ignored, one line each

    @cached_property
    def above(self) -> Dict[str, Joint]:
        """The joint between each link, except the root, and its parent."""
        return {joint.child: joint for joint in self.joints.values()}

    @cached_property
    def poses(self) -> Dict[str, np.ndarray]:
        """Each link's (4, 4) pose in the root link, joints at zero; parents before children."""
        poses, open_links = {self.root: np.eye(4)}, [self.root]
        while open_links:
            parent = open_links.pop()
            for joint in self.below(parent):
                poses[joint.child] = poses[parent] @ joint.child_in_parent
                open_links.append(joint.child)
        return poses

    def below(self, link: str) -> List[Joint]:
        """Return the joints to a link's children."""
        return [joint for joint in self.joints.values() if joint.parent == link]

    def joints_above(self, link: str) -> Iterator[Joint]:
        """Yield the joints from a link up to the root."""
        while link in self.above:
            yield self.above[link]
            link = self.above[link].parent

    def subtree(self, link: str, is_rigid: bool = False) -> Iterator[str]:
        """Yield a link's name and those of all links below it, or only of those fixed to it."""
        open_links = [link]
        while open_links:
            name = open_links.pop()
            yield name
            below = self.below(name)
            open_links += [joint.child for joint in reversed(below) if joint.kind == 'fixed' or not is_rigid]

    def axis_in_root(self, joint: Joint) -> np.ndarray:
        """Return a joint's (3,) unit axis in the root."""
        return np.asarray(self.poses[joint.child][:3, :3] @ joint.axis)

    def swivel_above(self, link: str) -> Optional[Joint]:
        """Return the nearest joint from a link up to the root that turns about an upright axis."""
        turning = (joint for joint in self.joints_above(link) if joint.kind in ('continuous', 'revolute'))
        return next((joint for joint in turning if abs(self.axis_in_root(joint)[2]) > UPRIGHT), None)


class Found(NamedTuple):
    """A value and its source, for the table that users read."""

    quantity: str  # such as 'wheel diameter [m]'
    value: str
    source: str  # such as 'libgazebo_ros_diff_drive: wheelDiameter'


class Findings:
    """The table, the warnings and the notes of a robot, one line each, in the order in which they were found."""

    def __init__(self) -> None:
        self.found: List[Found] = []
        self.warnings: List[str] = []  # likely mistakes in the robot's file
        self.notes: List[str] = []  # differences between the simulation and the robot's file
        self.warn, self.note = self.warnings.append, self.notes.append

    def add(self, quantity: str, value: object, source: str) -> None:
        """Add a row to the table."""
        self.found.append(Found(quantity, str(value), source))


class DrivenWheel(NamedTuple):
    """A link that can roll on the floor, driven or not."""

    joint: str
    link: str
    centre_m: Vector  # of the rolling shape, in the root
    axis: Vector  # the joint's unit axis, in the root
    radius_m: float  # 0: no shape of it rolls
    shape: str  # the source of the radius: 'collision cylinder'
    swivel: Optional[str]  # the upright joint above it, which steers it or lets it trail

    @property
    def is_forward_positive(self) -> bool:
        """Return whether a positive joint speed drives forward; else the joint's axis points to the right."""
        return self.axis[1] > 0.0


class GroundContact(NamedTuple):
    """A caster, ball, skid or hull edge that supports the robot."""

    name: str
    point_m: Vector  # the lowest point, in the root


class RobotLaser(NamedTuple):
    """A planar scanner as the URDF describes it."""

    link: str
    pose_in_root: np.ndarray  # (4, 4)
    settings: Dict[str, Any]  # keys of LidarParams: samples, angle_min, angle_span, range_min, range_max, noise, rate
    source: str
    carrier: str = ''  # link of its sensor; the scans may have another frame at the same place
    notes: Sequence[str] = ()

    @property
    def pose_in_base(self) -> Pose2D:
        """Return the pose in the plane of the root."""
        pose = self.pose_in_root
        return Pose2D(float(pose[0, 3]), float(pose[1, 3]), math.atan2(pose[1, 0], pose[0, 0]))


@dataclass(frozen=True, eq=False)
class DriveTrain:
    """The driven wheels and the nominal geometry that odometry, controller and physics assume."""

    left: DrivenWheel
    right: DrivenWheel
    wheel_diameters_m: Tuple[float, float]  # of the left and the right one
    wheel_separation_m: float  # between the contact points

    @property
    def wheel_diameter_m(self) -> float:
        """Return the mean nominal diameter of the wheels."""
        return 0.5 * sum(self.wheel_diameters_m)

    @property
    def radii_m(self) -> Tuple[float, float]:
        """Return the nominal radii of the left and the right wheel."""
        return 0.5 * self.wheel_diameters_m[0], 0.5 * self.wheel_diameters_m[1]

    @property
    def radius_m(self) -> float:
        """Return the mean nominal radius of the wheels."""
        return 0.5 * self.wheel_diameter_m

    @property
    def axle_x_m(self) -> float:
        """Return the axle's x in the root link."""
        return 0.5 * (self.left.centre_m[0] + self.right.centre_m[0])

    @property
    def middle_y_m(self) -> float:
        """Return the y of the middle between the wheels in the root link."""
        return 0.5 * (self.left.centre_m[1] + self.right.centre_m[1])

    @property
    def floor_z_m(self) -> float:
        """Return the floor's z in the root link: where the wheels touch it."""
        return 0.5 * (self.left.centre_m[2] + self.right.centre_m[2]) - self.radius_m


@dataclass(frozen=True, eq=False)
class RobotDescription(DriveTrain):
    """A differential-drive robot, ready for physics, odometry and navigation."""

    tree: RobotTree
    mass: MassProperties  # of all links
    contacts: Tuple[GroundContact, ...]
    hull: Tuple[Shape, ...]  # collision shapes of all but wheels and contacts, poses in the root, meshes replaced
    footprint: Tuple[Tuple[float, float], ...]  # (x, y), convex, counter-clockwise, wheels included
    laser: Optional[RobotLaser]
    drive_limits: Dict[str, float]  # keys of DriveParams that plugins and joint limits give
    found: Tuple[Found, ...]
    warnings: Tuple[str, ...]  # likely mistakes in the URDF, one line each
    notes: Tuple[str, ...]  # what was frozen, replaced or ignored, one line each
