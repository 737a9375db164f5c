"""Boxes, cylinders and balls in closed form: how far they reach, what they hold, whether they roll."""

from __future__ import annotations

import math
from typing import Iterable, Optional

import numpy as np

from diff_encoder_sim.robots.robot_tree import Box, Cylinder, Geometry, Mesh, Shape, Sphere

# A wheel rolls as its shape does where axle and shape are this well aligned: published numbers are rounded.
_OFF_AXIS = 0.05  # of the radius
_TILT = 0.02  # rad
_FACE_ON = 1e-9  # sine below which a face or a side lies flat: its middle stands for all of it


def placed(shape: Shape, pose: np.ndarray) -> Shape:
    """Return a shape in the frame in which `pose` (4, 4) is the pose of the shape's link."""
    return Shape(shape.geometry, pose @ shape.pose_in_link)


def volume_m3(geometry: Geometry) -> float:
    """Return a primitive's volume."""
    if isinstance(geometry, Box):
        return float(np.prod(geometry.size_xyz_m))
    if isinstance(geometry, Cylinder):
        return math.pi * geometry.radius_m**2 * geometry.length_m
    return 4 / 3 * math.pi * _primitive(geometry).radius_m ** 3


def support_point_m(shape: Shape, direction: np.ndarray) -> np.ndarray:
    """Return the shape's (3,) point that lies farthest in a (3,) direction, in the frame of the shape's pose.

    Of a face, an edge or a side that lies across the direction it is the middle.
    """
    turn, centre_m = shape.pose_in_link[:3, :3], shape.pose_in_link[:3, 3]
    along = turn.T @ (direction / np.linalg.norm(direction))
    return np.asarray(centre_m + turn @ _farthest_m(shape.geometry, along))


def reach_m(shapes: Iterable[Shape], direction: np.ndarray) -> float:
    """Return how far the shapes reach from the origin in a (3,) direction; -inf where there is no shape."""
    unit = direction / np.linalg.norm(direction)
    return max((float(unit @ support_point_m(shape, unit)) for shape in shapes), default=-math.inf)


def lowest_point_m(shape: Shape) -> np.ndarray:
    """Return the (3,) point that touches a level floor first, in the frame of the shape's pose."""
    return support_point_m(shape, np.array([0.0, 0.0, -1.0]))


def farthest_m(shapes: Iterable[Shape], point_m: np.ndarray) -> float:
    """Return a radius about a (3,) point that holds all shapes; 0 where there is no shape."""
    return max(
        (float(np.linalg.norm(s.pose_in_link[:3, 3] - point_m)) + _circumradius_m(s.geometry) for s in shapes),
        default=0.0,
    )


def holds_point(shape: Shape, point_m: np.ndarray) -> bool:
    """Return whether a (3,) point, in the frame of the shape's pose, is inside of a primitive."""
    x_m, y_m, z_m = (shape.pose_in_link[:3, :3].T @ (point_m - shape.pose_in_link[:3, 3])).tolist()
    geometry = shape.geometry
    if isinstance(geometry, Box):
        return all(abs(part) < 0.5 * size for part, size in zip((x_m, y_m, z_m), geometry.size_xyz_m))
    if isinstance(geometry, Cylinder):
        return math.hypot(x_m, y_m) < geometry.radius_m and abs(z_m) < 0.5 * geometry.length_m
    return math.sqrt(x_m**2 + y_m**2 + z_m**2) < _primitive(geometry).radius_m


def rolling_radius_m(shape: Shape, axis: np.ndarray) -> Optional[float]:
    """Return the radius on which a shape rolls about an axis through its link's origin.

    Args:
        shape: a primitive, its pose in the link that the joint turns.
        axis: (3,) unit vector in that link.

    Returns:
        The radius; None for a box, and for a body that is not centred on the axis or stands across it.
    """
    if not isinstance(shape.geometry, (Cylinder, Sphere)):
        return None
    off_axis_m = np.linalg.norm(np.cross(shape.pose_in_link[:3, 3], axis))
    if off_axis_m > _OFF_AXIS * shape.geometry.radius_m:
        return None
    if isinstance(shape.geometry, Cylinder) and np.linalg.norm(np.cross(shape.pose_in_link[:3, 2], axis)) > _TILT:
        return None
    return shape.geometry.radius_m


def _primitive(geometry: Geometry) -> Sphere:
    """Return what must be a ball: of Geometry only Mesh is left, which meshes.py replaces first."""
    assert not isinstance(geometry, (Box, Cylinder, Mesh)), geometry
    return geometry


def _farthest_m(geometry: Geometry, along: np.ndarray) -> np.ndarray:
    """Return a primitive's farthest point in a unit direction, both in its own frame."""
    sides = np.sign(np.where(np.abs(along) < _FACE_ON, 0.0, along))
    if isinstance(geometry, Box):
        return np.asarray(0.5 * sides * geometry.size_xyz_m)
    if isinstance(geometry, Cylinder):
        across = np.array([along[0], along[1], 0.0])
        sine = float(np.linalg.norm(across))
        rim_m = geometry.radius_m * across / sine if sine > _FACE_ON else np.zeros(3)
        return np.asarray(rim_m + [0.0, 0.0, 0.5 * sides[2] * geometry.length_m])
    return np.asarray(_primitive(geometry).radius_m * along)


def _circumradius_m(geometry: Geometry) -> float:
    """Return the radius of the ball about a primitive."""
    if isinstance(geometry, Box):
        return 0.5 * float(np.linalg.norm(geometry.size_xyz_m))
    if isinstance(geometry, Cylinder):
        return math.hypot(geometry.radius_m, 0.5 * geometry.length_m)
    return _primitive(geometry).radius_m
