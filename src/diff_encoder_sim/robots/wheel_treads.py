"""Where the mesh of a wheel rolls: its widest circle about the axle, without hub, motor or bracket."""

from __future__ import annotations

from typing import Iterator, Optional

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.mesh_corners import MeshFinder, link_corners_m
from diff_encoder_sim.robots.robot_tree import Cylinder, Joint, Mesh, RobotTree, Shape

RIM = 0.98  # of the radius: what is farther out rolls
LARGEST_GAP_RAD = 1.2  # between points of the rim, seen from the axle: a hexagon is round, a box is not
NARROWEST_M = 1e-3


def mesh_treads(tree: RobotTree, joint: Joint, link: str, find: MeshFinder, visual: bool) -> Iterator[Shape]:
    """Yield the treads of a link's meshes about a joint that turns it, each a cylinder in the link.

    Args:
        tree: the robot as parsed.
        joint: what turns the link.
        link: the joint's child, or a link fixed to it.
        find: finds a mesh's file.
        visual: whether to look at visual rather than collision meshes; those that cannot be read are left out then.

    Raises:
        ConfigError: a collision mesh cannot be read.
    """
    poses = tree.link_poses()
    to_link = np.linalg.inv(poses[link]) @ poses[joint.child]
    part = tree.links[link]
    for shape in part.visuals if visual else part.collisions:
        try:
            points_m = points_in_link_m(shape, find, f'{tree.where}: link {link!r}')
        except ConfigError:
            if not visual:
                raise
            continue
        tread = None if points_m is None else tread_of(points_m, to_link[:3, 3], to_link[:3, :3] @ joint.axis)
        if tread is not None:
            yield tread


def points_in_link_m(shape: Shape, find: MeshFinder, where: str) -> Optional[np.ndarray]:
    """Return the (n, 3) outer points of a mesh in its link; None of another shape.

    Raises:
        ConfigError: the mesh is missing or cannot be read.
    """
    return link_corners_m(shape, where, find) if isinstance(shape.geometry, Mesh) else None


def tread_of(points_m: np.ndarray, centre_m: np.ndarray, axis: np.ndarray) -> Optional[Shape]:
    """Return the cylinder on which (n, 3) points roll about an axis (3,) through a point (3,); None if not round."""
    across, up = _perpendiculars(axis)
    from_axle_m = points_m - centre_m
    along_m = from_axle_m @ axis
    x_m, y_m = from_axle_m @ across, from_axle_m @ up
    radii_m = np.hypot(x_m, y_m)
    rim = radii_m > RIM * radii_m.max()
    bearings_rad = np.sort(np.arctan2(y_m[rim], x_m[rim]))
    if np.diff(bearings_rad, append=bearings_rad[0] + 2.0 * np.pi).max() > LARGEST_GAP_RAD:
        return None
    low_m, high_m = float(along_m[rim].min()), float(along_m[rim].max())
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([across, up, axis])
    pose[:3, 3] = centre_m + 0.5 * (low_m + high_m) * axis
    return Shape(Cylinder(round(float(radii_m.max()), 6), max(high_m - low_m, NARROWEST_M)), pose)


def _perpendiculars(axis: np.ndarray) -> np.ndarray:
    """Return two (3,) unit vectors that make a right-handed frame with an axis as its third."""
    across = np.cross(np.eye(3)[np.abs(axis).argmin()], axis)
    across /= np.linalg.norm(across)
    return np.array([across, np.cross(axis, across)])
