"""Boxes, cylinders and balls in closed form: reach, volume, mass and inertia."""

from __future__ import annotations

import math
from itertools import combinations
from typing import Iterable, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from diff_encoder_sim.robots.description import Box, Cylinder, Geometry, Inertial, MassProperties, Mesh, Shape, Sphere

# A point that is this much farther out than the radius still counts as inside: rounding of the circumcentres.
_SLACK = 1e-9


class Ball(NamedTuple):
    """A ball, in two dimensions a circle."""

    centre_m: np.ndarray  # (d,)
    radius_m: float


def smallest_ball(points_m: np.ndarray) -> Ball:
    """Return the smallest ball around (n, d) points, d 2 or 3.

    A few points on its rim decide it: they are found by adding the point that is farthest out, each time to those
    that decided so far, until none is out. The radius grows with each, so this ends.

    trimesh.nsphere.minimum_nsphere is no replacement: it returns radius 3.83 for the triangle (-1, 0), (1, 0),
    (0.5, 0.1), which needs 1, and raises an error for flat sheets.
    """
    rim_m = points_m[:1]
    ball = Ball(points_m[0], 0.0)
    slack_m = _SLACK * float(np.ptp(points_m, axis=0).max())
    while True:
        distances_m = np.linalg.norm(points_m - ball.centre_m, axis=1)
        farthest = int(distances_m.argmax())
        if distances_m[farthest] <= ball.radius_m + slack_m:
            return ball
        larger, rim_m = _ball_of_few(np.vstack([rim_m, points_m[farthest]]), slack_m)
        if larger.radius_m <= ball.radius_m:  # all that rounding leaves to gain
            return Ball(ball.centre_m, float(distances_m[farthest]))
        ball = larger


def _ball_of_few(points_m: np.ndarray, slack_m: float) -> Tuple[Ball, np.ndarray]:
    """Return the smallest ball around up to d + 2 points, and those of them that are on its rim."""
    best, best_rim_m = Ball(points_m[0], np.inf), points_m
    for count in range(2, points_m.shape[1] + 2):
        for chosen in combinations(points_m, count):
            rim_m = np.array(chosen)
            ball = _ball_through(rim_m)
            reach_m = np.linalg.norm(points_m - ball.centre_m, axis=1).max()
            if reach_m <= ball.radius_m + slack_m and ball.radius_m < best.radius_m:
                best, best_rim_m = ball, rim_m
    return best, best_rim_m


def _ball_through(points_m: np.ndarray) -> Ball:
    """Return the smallest ball that has all points on its rim: its centre is in their affine span."""
    sides_m = points_m[1:] - points_m[0]
    centre_from_first_m = np.linalg.lstsq(2 * sides_m, np.sum(sides_m**2, axis=1), rcond=None)[0]
    return Ball(points_m[0] + centre_from_first_m, float(np.linalg.norm(centre_from_first_m)))


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


_WATER_KGM3 = 1000.0


def merged(bodies: Iterable[MassProperties]) -> MassProperties:
    """Return several bodies of one frame as one rigid body; no body at all has no mass."""
    parts = list(bodies)
    mass_kg = math.fsum(part.mass_kg for part in parts)
    if mass_kg <= 0:
        return MassProperties(0.0, np.zeros(3), np.zeros((3, 3)))
    com_m = np.sum([part.mass_kg * part.com_m for part in parts], axis=0) / mass_kg
    inertia_kgm2 = np.sum([_inertia_about(part, com_m) for part in parts], axis=0)
    return MassProperties(mass_kg, com_m, inertia_kgm2)


def link_mass(inertial: Inertial, link_pose: np.ndarray) -> MassProperties:
    """Return a link's mass in the frame in which `link_pose` (4, 4) is the link's pose."""
    turn = link_pose[:3, :3]
    com_m = turn @ inertial.com_in_link_m + link_pose[:3, 3]
    return MassProperties(inertial.mass_kg, com_m, turn @ inertial.inertia_kgm2 @ turn.T)


def homogeneous(shapes: Sequence[Shape], mass_kg: float) -> MassProperties:
    """Return primitives of one frame as a homogeneous solid; what they share counts twice.

    Without a shape it is a ball of water in the frame's origin: 17 mm for 20 g, 27 cm for 80 kg.
    """
    if not shapes:
        radius_m = (3 * mass_kg / (4 * math.pi * _WATER_KGM3)) ** (1 / 3)
        shapes = [Shape(Sphere(radius_m), np.eye(4))]
    volumes_m3 = [volume_m3(shape.geometry) for shape in shapes]
    density_kgm3 = mass_kg / math.fsum(volumes_m3)
    return merged(_solid(shape, density_kgm3 * volume) for shape, volume in zip(shapes, volumes_m3))


def _inertia_about(body: MassProperties, point_m: np.ndarray) -> np.ndarray:
    """Return a body's (3, 3) inertia about any (3,) point: the parallel-axis theorem."""
    arm_m = body.com_m - point_m
    return np.asarray(body.inertia_kgm2 + body.mass_kg * (arm_m @ arm_m * np.eye(3) - np.outer(arm_m, arm_m)))


def _solid(shape: Shape, mass_kg: float) -> MassProperties:
    """Return one primitive as a homogeneous solid."""
    inertial = Inertial(mass_kg, np.zeros(3), mass_kg * np.diag(_squared_gyration_radii_m2(shape.geometry)))
    return link_mass(inertial, shape.pose_in_link)


def _squared_gyration_radii_m2(geometry: Geometry) -> np.ndarray:
    """Return a primitive's (3,) squared radii of gyration about its own axes."""
    if isinstance(geometry, Box):
        squares_m2 = np.square(geometry.size_xyz_m)
        return np.asarray((squares_m2.sum() - squares_m2) / 12)
    if isinstance(geometry, Cylinder):
        across_m2 = (3 * geometry.radius_m**2 + geometry.length_m**2) / 12
        return np.array([across_m2, across_m2, geometry.radius_m**2 / 2])
    assert isinstance(geometry, Sphere)
    return np.full(3, 0.4 * geometry.radius_m**2)
