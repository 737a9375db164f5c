"""What touches the floor beside the drive wheels: casters, balls, skids, edges of the hull."""

from __future__ import annotations

import re
from typing import Iterator, List, NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.robots.robot_description import GroundContact
from diff_encoder_sim.robots.robot_tree import RobotTree, Shape
from diff_encoder_sim.robots.rolling_wheels import is_upright, joints_above
from diff_encoder_sim.robots.solids import farthest_m, placed, support_point_m

# How far above the floor a contact may end: a caster's clearance, rounded numbers. More where its name says caster.
NEAR_M = 0.005
NEAR_RADII = 0.1  # of the drive wheels
NAMED_RADII = 0.5
CASTER_NAMES = re.compile('caster|castor|ball|skid|wheel|support|roller|slider', re.IGNORECASE)

TILT = 1e-3  # rad, by which the front and the rear edge of a flat face are told apart
LONG_RADII = 1.0  # of the drive wheels: a longer face stands on its edges
SAME_HEIGHT_M = 1e-3
SMALLEST_M = 2e-3  # a marker, not a body


class WheelBase(NamedTuple):
    """Where the drive wheels stand, in the root."""

    axle_x_m: float
    floor_z_m: float
    radius_m: float
    links: Tuple[str, ...]  # of the drive wheels, with all that hangs on them


def ground_contacts(tree: RobotTree, wheels: WheelBase) -> Tuple[GroundContact, ...]:
    """Return what is near the floor, front to back.

    Args:
        tree: the robot, meshes replaced.
        wheels: of the drive.
    """
    contacts: List[GroundContact] = []
    poses = tree.link_poses()
    for name in poses:
        if name not in wheels.links:
            contacts += _contacts(tree, name, list(_body(tree, name, poses[name])), wheels)
    return tuple(sorted(contacts, key=lambda contact: -contact.point_m[0]))


def lowest_edges_m(shapes: List[Shape]) -> List[np.ndarray]:
    """Return the (3,) foremost and rearmost points of the shapes' lower sides."""
    return [support_point_m(shape, np.array([tilt, 0.0, -1.0])) for shape in shapes for tilt in (TILT, -TILT)]


def _body(tree: RobotTree, name: str, pose: np.ndarray) -> Iterator[Shape]:
    """Yield a link's shapes in the root: collision, or visual where it has none."""
    link = tree.links[name]
    for shape in link.collisions or link.visuals:
        in_root = placed(shape, pose)
        if farthest_m([in_root], in_root.pose_in_link[:3, 3]) > SMALLEST_M:
            yield in_root


def _contacts(tree: RobotTree, name: str, shapes: List[Shape], wheels: WheelBase) -> Iterator[GroundContact]:
    """Yield a link's contacts: none, one, or its front and its rear edge."""
    near_m = max(NEAR_M, (NAMED_RADII if CASTER_NAMES.search(name) else NEAR_RADII) * wheels.radius_m)
    points_m = lowest_edges_m(shapes)
    lowest_m = min((float(point[2]) for point in points_m), default=np.inf)
    if lowest_m > wheels.floor_z_m + near_m:
        return
    points_m = sorted((p for p in points_m if p[2] < lowest_m + SAME_HEIGHT_M), key=lambda point: float(point[0]))
    foot_m = _swivel_foot_m(tree, name)
    if foot_m is not None:
        yield _contact(name, np.array([foot_m[0], foot_m[1], lowest_m]))
    elif points_m[-1][0] - points_m[0][0] > LONG_RADII * wheels.radius_m:
        yield _contact(f'{name} (front)', points_m[-1])
        yield _contact(f'{name} (rear)', points_m[0])
    else:
        yield _contact(name, np.append(np.mean(points_m, axis=0)[:2], lowest_m))


def _swivel_foot_m(tree: RobotTree, link: str) -> Optional[np.ndarray]:
    """Return the (3,) origin of the swivel that a link hangs on, in the root.

    A caster trails behind its swivel forward and in front of it backward: its mean place is the swivel's, wherever the
    file draws it.
    """
    swivel = next((joint for joint in joints_above(tree, link) if is_upright(tree, joint)), None)
    return None if swivel is None else tree.link_poses()[swivel.child][:3, 3]


def _contact(name: str, point_m: np.ndarray) -> GroundContact:
    x_m, y_m, z_m = point_m.tolist()
    return GroundContact(name, (x_m, y_m, z_m))
