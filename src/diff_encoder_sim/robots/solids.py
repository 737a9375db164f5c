"""Shapes of robots and worlds; boxes, cylinders and balls in closed form: reach, volume, mass and inertia."""

from __future__ import annotations

import math
from typing import Iterable, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from diff_encoder_sim.base.xml_values import Vector

# A wheel rolls as its shape does if axle and shape are this well aligned: published numbers are rounded.
_OFF_AXIS = 0.05  # of the radius
_TILT = 0.02  # rad
_FACE_ON = 1e-9  # sine below which a face or a side lies flat: its middle stands for all of it
_WATER_KGM3 = 1000.0


class Box(NamedTuple):
    """A cuboid, centred on its pose."""

    size_xyz_m: Vector


class Cylinder(NamedTuple):
    """A cylinder along z, centred on its pose; a URDF capsule is one, too."""

    radius_m: float
    length_m: float


class Sphere(NamedTuple):
    """A ball, centred on its pose."""

    radius_m: float


class Mesh(NamedTuple):
    """A mesh in a file, as the URDF names it."""

    uri: str  # package://, file://, or a path relative to the robot's file
    scale_xyz: Vector


Geometry = Union[Box, Cylinder, Sphere, Mesh]


class Shape(NamedTuple):
    """A visual or collision shape."""

    geometry: Geometry
    pose_in_link: np.ndarray  # (4, 4)
    corners_m: Optional[np.ndarray] = None  # (n, 3) in the link: the convex hull of the collision mesh that it replaces

    def placed(self, pose: np.ndarray) -> Shape:
        """Return the shape in the frame in which `pose` (4, 4) is the pose of the shape's link."""
        return Shape(self.geometry, pose @ self.pose_in_link)

    def support_point_m(self, direction: np.ndarray) -> np.ndarray:
        """Return the (3,) point that lies farthest in a (3,) direction, in the frame of the shape's pose.

        Of a face, an edge or a side that lies across the direction it is the middle.
        """
        turn, geometry = self.pose_in_link[:3, :3], self.geometry
        along = turn.T @ (direction / np.linalg.norm(direction))
        sides = np.sign(np.where(np.abs(along) < _FACE_ON, 0.0, along))
        if isinstance(geometry, Box):
            farthest_m = 0.5 * sides * geometry.size_xyz_m
        elif isinstance(geometry, Cylinder):
            across = np.array([along[0], along[1], 0.0])
            sine = float(np.linalg.norm(across))
            rim_m = geometry.radius_m * across / sine if sine > _FACE_ON else np.zeros(3)
            farthest_m = rim_m + [0.0, 0.0, 0.5 * sides[2] * geometry.length_m]
        else:
            farthest_m = measures(geometry)[1] * along
        return np.asarray(self.pose_in_link[:3, 3] + turn @ farthest_m)

    def holds(self, point_m: np.ndarray) -> bool:
        """Return whether a (3,) point, in the frame of the shape's pose, is inside of a primitive."""
        local_m, geometry = self.pose_in_link[:3, :3].T @ (point_m - self.pose_in_link[:3, 3]), self.geometry
        if isinstance(geometry, Box):
            return bool((np.abs(local_m) < 0.5 * np.array(geometry.size_xyz_m)).all())
        if isinstance(geometry, Cylinder):
            return bool(np.hypot(*local_m[:2]) < geometry.radius_m and abs(local_m[2]) < 0.5 * geometry.length_m)
        return bool(np.linalg.norm(local_m) < measures(geometry)[1])

    def rolling_radius_m(self, axis: np.ndarray) -> float:
        """Return the radius on which it rolls about an axis (3,) through the origin of the link that a joint turns.

        0 for a box, and for a body that is not centred on the axis or stands across it.
        """
        if not isinstance(self.geometry, (Cylinder, Sphere)):
            return 0.0
        is_off = np.linalg.norm(np.cross(self.pose_in_link[:3, 3], axis)) > _OFF_AXIS * self.geometry.radius_m
        is_tilted = np.linalg.norm(np.cross(self.pose_in_link[:3, 2], axis)) > _TILT
        return 0.0 if is_off or (isinstance(self.geometry, Cylinder) and is_tilted) else self.geometry.radius_m


class MassProperties(NamedTuple):
    """Mass of a link in its own frame, or of a robot or its parts in the root's frame."""

    mass_kg: float
    com_m: np.ndarray  # (3,)
    inertia_kgm2: np.ndarray  # (3, 3), about the centre of mass, along the frame's axes

    def moved(self, pose: np.ndarray) -> MassProperties:
        """Return a link's mass in the frame in which `pose` (4, 4) is the link's pose."""
        turn = pose[:3, :3]
        return MassProperties(self.mass_kg, turn @ self.com_m + pose[:3, 3], turn @ self.inertia_kgm2 @ turn.T)

    def can_be_of_a_body(self, rounding: float = 0.0) -> bool:
        """Return whether the principal moments are positive, and none exceeds the sum of the others."""
        smallest, middle, largest = np.linalg.eigvalsh(self.inertia_kgm2)
        return bool(smallest > 0 and smallest + middle >= (1.0 - rounding) * largest)


def vector(array: np.ndarray) -> Vector:
    """Return a (3,) array as a tuple."""
    x, y, z = array.tolist()
    return x, y, z


def pose_at(centre_m: Union[np.ndarray, Sequence[float]], axes: Optional[np.ndarray] = None) -> np.ndarray:
    """Return the (4, 4) pose of a frame with a (3,) origin and (3, 3) axes, those of the parent by default."""
    pose = np.eye(4)
    if axes is not None:
        pose[:3, :3] = axes
    pose[:3, 3] = centre_m
    return pose


def measures(geometry: Geometry) -> Tuple[float, float, np.ndarray]:
    """Return volume [m^3], circumradius [m] and (3,) squared radii of gyration [m^2] of a primitive, about its axes."""
    if isinstance(geometry, Box):
        squares_m2 = np.square(geometry.size_xyz_m)
        circumradius_m = 0.5 * float(np.linalg.norm(geometry.size_xyz_m))
        return float(np.prod(geometry.size_xyz_m)), circumradius_m, (squares_m2.sum() - squares_m2) / 12
    if isinstance(geometry, Cylinder):
        radius_m, length_m = geometry
        across_m2 = (3 * radius_m**2 + length_m**2) / 12
        gyration_m2 = np.array([across_m2, across_m2, radius_m**2 / 2])
        return math.pi * radius_m**2 * length_m, math.hypot(radius_m, 0.5 * length_m), gyration_m2
    assert isinstance(geometry, Sphere), geometry  # meshes.py replaces meshes first
    (radius_m,) = geometry
    return 4 / 3 * math.pi * radius_m**3, radius_m, np.full(3, 0.4 * radius_m**2)


def reach_m(shapes: Iterable[Shape], direction: np.ndarray) -> float:
    """Return how far the shapes reach from the origin in a (3,) direction; -inf without a shape."""
    unit = direction / np.linalg.norm(direction)
    return max((float(unit @ shape.support_point_m(unit)) for shape in shapes), default=-math.inf)


def farthest_m(shapes: Iterable[Shape], point_m: np.ndarray) -> float:
    """Return a radius about a (3,) point that holds all shapes; 0 without a shape."""
    places = [(float(np.linalg.norm(shape.pose_in_link[:3, 3] - point_m)), shape.geometry) for shape in shapes]
    return max((away_m + measures(geometry)[1] for away_m, geometry in places), default=0.0)


def merged(bodies: Iterable[MassProperties]) -> MassProperties:
    """Return several bodies of one frame as one rigid body, by the parallel-axis theorem; no body has no mass."""
    parts = list(bodies)
    mass_kg = math.fsum(part.mass_kg for part in parts)
    if mass_kg <= 0:
        return MassProperties(0.0, np.zeros(3), np.zeros((3, 3)))
    com_m = np.sum([part.mass_kg * part.com_m for part in parts], axis=0) / mass_kg
    inertia_kgm2 = np.zeros((3, 3))
    for part in parts:
        arm = part.com_m - com_m
        inertia_kgm2 += part.inertia_kgm2 + part.mass_kg * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    return MassProperties(mass_kg, com_m, inertia_kgm2)


def homogeneous(shapes: Sequence[Shape], mass_kg: float) -> MassProperties:
    """Return primitives of one frame as a homogeneous solid; what they share counts twice.

    Without a shape it is a ball of water in the frame's origin: 17 mm for 20 g, 27 cm for 80 kg.
    """
    if not shapes:
        shapes = [Shape(Sphere((3 * mass_kg / (4 * math.pi * _WATER_KGM3)) ** (1 / 3)), np.eye(4))]
    sizes = [measures(shape.geometry) for shape in shapes]
    density_kgm3 = mass_kg / math.fsum(volume_m3 for volume_m3, _, _ in sizes)
    parts = []
    for shape, (volume_m3, _, squared_radii_m2) in zip(shapes, sizes):
        part_kg = density_kgm3 * volume_m3
        inertia_kgm2 = part_kg * np.diag(squared_radii_m2)
        parts.append(MassProperties(part_kg, np.zeros(3), inertia_kgm2).moved(shape.pose_in_link))
    return merged(parts)
