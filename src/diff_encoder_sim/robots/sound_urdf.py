"""Whether a URDF has what a rigid-body simulation needs: then it is simulated with its own masses and shapes."""

from __future__ import annotations

from typing import Collection, Iterator, List, NamedTuple, Optional

import numpy as np

from diff_encoder_sim.robots.mass_properties import link_mass, merged
from diff_encoder_sim.robots.physics_urdf import TrueWheels
from diff_encoder_sim.robots.robot_tree import Joint, Link, Mesh, RobotTree, Sphere
from diff_encoder_sim.robots.solids import lowest_point_m, placed

_SAME = 1e-6  # m, and of a unit vector: how exactly wheels stand side by side, and touch the floor
# A shape that is closer to the floor than this, of the wheel's radius, is one to lean on.
_NEAR_FLOOR = 0.1
_CLEAR_M = 1e-3  # and one that hangs higher than this is not leant on
_INSIDE = np.s_[:3, 3]


class _Ball(NamedTuple):
    """A link whose only collision shape is a ball about its joint."""

    centre_m: np.ndarray  # (3,) in the root
    radius_m: float


class _NearFloor(NamedTuple):
    """A collision shape on which the robot leans, or would if it tipped over."""

    x_m: float
    gap_m: float  # to the floor
    slides: bool  # a ball without friction


def sound_wheels(tree: RobotTree, left_joint: str, right_joint: str) -> Optional[TrueWheels]:
    """Return the wheels of a URDF that a rigid-body simulation moves as its wheels roll; None of any other.

    Each link has a mass and an inertia that a body can have; nothing moves but the wheels, which are balls about
    their joints; and the robot stands on them and on balls without friction that are all on its centre of mass's side.
    """
    moving = {name for name, joint in tree.joints.items() if joint.kind != 'fixed'}
    if moving != {left_joint, right_joint} or not all(_is_solid(link) for link in tree.links.values()):
        return None
    left, right = (_wheel(tree, tree.joints[name]) for name in (left_joint, right_joint))
    if left is None or right is None or _has_resistance(tree):
        return None
    floor_z_m = left.centre_m[2] - left.radius_m
    is_level = np.abs(right.centre_m - left.centre_m)[0] < _SAME > abs(right.centre_m[2] - right.radius_m - floor_z_m)
    wheels = {tree.joints[left_joint].child, tree.joints[right_joint].child}
    contacts = list(_near_floor(tree, wheels, floor_z_m, _NEAR_FLOOR * left.radius_m))
    if not is_level or not _stands_on_three_points(contacts, left.centre_m[0], _com_x_m(tree)):
        return None
    return TrueWheels(left.radius_m, right.radius_m, float(left.centre_m[1] - right.centre_m[1]))


def _is_solid(link: Link) -> bool:
    """Return whether a link has the mass of a body, and no mesh as collision shape."""
    if link.inertial is None or any(isinstance(shape.geometry, Mesh) for shape in link.collisions):
        return False
    smallest, middle, largest = np.linalg.eigvalsh(link.inertial.inertia_kgm2)
    return bool(link.inertial.mass_kg > 0 and smallest > 0 and smallest + middle >= largest)


def _wheel(tree: RobotTree, joint: Joint) -> Optional[_Ball]:
    """Return a wheel that is a ball about its joint, which turns forward about the root's y; None of another."""
    pose, shapes = tree.link_poses()[joint.child], tree.links[joint.child].collisions
    if len(shapes) != 1 or np.abs(pose[:3, :3] @ joint.axis - (0.0, 1.0, 0.0)).max() > _SAME:
        return None
    geometry, centre_m = shapes[0].geometry, shapes[0].pose_in_link[_INSIDE]
    if not isinstance(geometry, Sphere) or np.abs(centre_m).max() > _SAME:
        return None
    return _Ball(pose[_INSIDE], geometry.radius_m)


def _has_resistance(tree: RobotTree) -> bool:
    """Return whether a contact resists rolling or spinning, or bounces, by PyBullet's tags."""
    tags = (tag for contact in tree.xml.iterfind('link/contact') for tag in contact if tag.tag != 'lateral_friction')
    return any(tag.get('value') not in ('0', '0.0') for tag in tags)


def _near_floor(tree: RobotTree, wheels: Collection[str], floor_z_m: float, near_m: float) -> Iterator[_NearFloor]:
    """Yield the shapes of other links that are near the floor."""
    poses = tree.link_poses()
    for name, link in tree.links.items():
        for shape in link.collisions if name not in wheels else ():
            x_m, _, z_m = lowest_point_m(placed(shape, poses[name])).tolist()
            if z_m - floor_z_m < near_m:
                yield _NearFloor(x_m, z_m - floor_z_m, isinstance(shape.geometry, Sphere) and link.friction == 0)


def _stands_on_three_points(contacts: List[_NearFloor], axle_x_m: float, com_x_m: float) -> bool:
    """Return whether the robot leans where its centre of mass is, and hangs clear on the other side of the axle."""
    side = np.sign(com_x_m - axle_x_m)
    down = [contact for contact in contacts if contact.gap_m < _CLEAR_M]
    return (
        all(contact.slides and contact.gap_m > -_SAME for contact in contacts)
        and bool(down)
        and all(side * (contact.x_m - axle_x_m) > 0 for contact in down)
    )


def _com_x_m(tree: RobotTree) -> float:
    poses = tree.link_poses()
    masses = (link_mass(link.inertial, poses[name]) for name, link in tree.links.items() if link.inertial is not None)
    return float(merged(masses).com_m[0])
