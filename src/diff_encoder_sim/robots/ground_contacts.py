"""What touches the floor beside the drive wheels: casters, balls, skids, edges of the hull."""

from __future__ import annotations

import re
from typing import Callable, Iterator, List, NamedTuple, Optional, Tuple

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

TILT = 1e-3  # rad, by which the front and the rear edge of a flat face are distinguished
SAME_HEIGHT_M = 1e-3
LONG_RADII = 1.0  # of the drive wheels: what is longer stands on its outer edge
SMALLEST_M = 2e-3  # a marker, not a body
BESIDE_AXLE_M = 1e-3  # what is nearer to the axle carries nothing

# Returns the (n, 3) points of a link's collision mesh in its link, by the link's name and the shape's number.
MeshPoints = Callable[[str, int], Optional[np.ndarray]]


class WheelBase(NamedTuple):
    """Where the drive wheels stand, in the root."""

    axle_x_m: float
    floor_z_m: float
    radius_m: float
    links: Tuple[str, ...]  # of the drive wheels, with all that hangs on them


def ground_contacts(tree: RobotTree, wheels: WheelBase, mesh_points: MeshPoints) -> Tuple[GroundContact, ...]:
    """Return what is near the floor, front to back: of each link at most one before and one behind the axle.

    Args:
        tree: the robot, meshes replaced.
        wheels: of the drive.
        mesh_points: what was replaced, for shapes that come near the floor.
    """
    contacts: List[GroundContact] = []
    for name, pose in tree.link_poses().items():
        if name not in wheels.links:
            contacts += _contacts(tree, name, _low_points_m(tree, name, pose, wheels, mesh_points), wheels)
    kept = _lowest(contacts, wheels, 1) + _lowest(contacts, wheels, -1)
    return tuple(sorted(kept, key=lambda contact: -contact.point_m[0]))


def _lowest(contacts: List[GroundContact], wheels: WheelBase, side: int) -> List[GroundContact]:
    """Return the contacts on a side of the axle that come nearly as low as its lowest: no forks above casters."""
    there = [contact for contact in contacts if side * (contact.point_m[0] - wheels.axle_x_m) > BESIDE_AXLE_M]
    lowest_m = min((contact.point_m[2] for contact in there), default=0.0)
    return [contact for contact in there if contact.point_m[2] <= lowest_m + NEAR_M]


def lowest_edges_m(shape: Shape) -> List[np.ndarray]:
    """Return the (3,) foremost and rearmost points of a shape's lower side."""
    return [support_point_m(shape, np.array([tilt, 0.0, -1.0])) for tilt in (TILT, -TILT)]


def _near_m(name: str, wheels: WheelBase) -> float:
    return max(NEAR_M, (NAMED_RADII if CASTER_NAMES.search(name) else NEAR_RADII) * wheels.radius_m)


def _low_points_m(
    tree: RobotTree, name: str, pose: np.ndarray, wheels: WheelBase, mesh_points: MeshPoints
) -> np.ndarray:
    """Return the (n, 3) points of a link near the floor: of its collision shapes, or of visual ones without these."""
    link, found_m = tree.links[name], [np.empty((0, 3))]
    highest_m = wheels.floor_z_m + _near_m(name, wheels)
    for number, shape in enumerate(link.collisions or link.visuals):
        in_root = placed(shape, pose)
        points_m = np.array(lowest_edges_m(in_root))
        if points_m[:, 2].min() > highest_m or farthest_m([in_root], in_root.pose_in_link[:3, 3]) < SMALLEST_M:
            continue
        mesh_m = mesh_points(name, number) if link.collisions else None
        if mesh_m is not None:
            points_m = mesh_m @ pose[:3, :3].T + pose[:3, 3]
        found_m.append(points_m[points_m[:, 2] <= highest_m])
    return np.vstack(found_m)


def _contacts(tree: RobotTree, name: str, points_m: np.ndarray, wheels: WheelBase) -> Iterator[GroundContact]:
    """Yield a link's contacts, by its (n, 3) points near the floor."""
    foot_m = _swivel_foot_m(tree, name)
    if foot_m is not None and len(points_m):
        yield _contact(name, np.append(foot_m[:2], points_m[:, 2].min()))
        return
    sides = [_carrying_point_m(points_m, wheels, side) for side in (1, -1)]
    for side_name, point_m in zip(('front', 'rear'), sides):
        if point_m is not None:
            yield _contact(name if any(other is None for other in sides) else f'{name} ({side_name})', point_m)


def _carrying_point_m(points_m: np.ndarray, wheels: WheelBase, side: int) -> Optional[np.ndarray]:
    """Return where a link's (n, 3) points carry it on one side of the axle: in their middle, or at the outer edge."""
    there_m = points_m[side * (points_m[:, 0] - wheels.axle_x_m) > BESIDE_AXLE_M]
    if len(there_m) == 0:
        return None
    low_m = there_m[there_m[:, 2] <= there_m[:, 2].min() + SAME_HEIGHT_M]
    middle_m = 0.5 * (low_m.min(axis=0) + low_m.max(axis=0))
    if np.ptp(low_m[:, 0]) > LONG_RADII * wheels.radius_m:
        middle_m[0] = side * (side * low_m[:, 0]).max()
    return np.append(middle_m[:2], low_m[:, 2].min())


def _swivel_foot_m(tree: RobotTree, link: str) -> Optional[np.ndarray]:
    """Return the (3,) origin of the swivel that a link hangs on, in the root.

    A caster trails behind its swivel forward and in front of it backward: its mean place is the swivel's, wherever the
    file draws it.
    """
    swivel = next((joint for joint in joints_above(tree, link) if is_upright(tree, joint)), None)
    return None if swivel is None else np.asarray(tree.link_poses()[swivel.child][:3, 3])


def _contact(name: str, point_m: np.ndarray) -> GroundContact:
    x_m, y_m, z_m = point_m.tolist()
    return GroundContact(name, (x_m, y_m, z_m))
