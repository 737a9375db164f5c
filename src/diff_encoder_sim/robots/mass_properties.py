"""Masses of links joined: the parallel-axis theorem, and homogeneous solids in closed form."""

from __future__ import annotations

import math
from typing import Iterable, Sequence

import numpy as np

from diff_encoder_sim.robots.robot_description import MassProperties
from diff_encoder_sim.robots.robot_tree import Box, Cylinder, Geometry, Inertial, Shape, Sphere
from diff_encoder_sim.robots.solids import volume_m3

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
