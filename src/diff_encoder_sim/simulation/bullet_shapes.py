"""Shapes and rotations as PyBullet takes them."""

from __future__ import annotations

from typing import Any, Dict, Tuple

import numpy as np

from diff_encoder_sim.robots.robot_tree import Box, Cylinder, Sphere
from diff_encoder_sim.simulation.quiet_pybullet import pybullet
from diff_encoder_sim.simulation.world import Solid

QuatXyzw = Tuple[float, float, float, float]


def shape_arguments(solid: Solid) -> Dict[str, Any]:
    """Return PyBullet's arguments for a solid's collision shape."""
    shape = solid.shape
    if isinstance(shape, Box):
        return {'shapeType': pybullet.GEOM_BOX, 'halfExtents': [0.5 * length_m for length_m in shape.size_xyz_m]}
    if isinstance(shape, Cylinder):
        return {'shapeType': pybullet.GEOM_CYLINDER, 'radius': shape.radius_m, 'height': shape.length_m}
    if isinstance(shape, Sphere):
        return {'shapeType': pybullet.GEOM_SPHERE, 'radius': shape.radius_m}
    return {'shapeType': pybullet.GEOM_PLANE}


def add_shape(client: int, solid: Solid) -> int:
    """Make a solid's collision shape in one of PyBullet's worlds, and return its number."""
    return int(pybullet.createCollisionShape(physicsClientId=client, **shape_arguments(solid)))


def add_body(client: int, shape: int, solid: Solid) -> int:
    """Put a solid of a shape into one of PyBullet's worlds, and return its number there."""
    # A plain rigid body: one of PyBullet's multibodies is moved on in each step even where it
    # stands still, which in a world of 49 solids takes a third of the time.
    return int(
        pybullet.createMultiBody(
            baseMass=0,
            baseCollisionShapeIndex=shape,
            basePosition=solid.pose_in_world[:3, 3].tolist(),
            baseOrientation=quat_xyzw(solid.pose_in_world[:3, :3]),
            useMaximalCoordinates=1,
            physicsClientId=client,
        )
    )


def remove_body(client: int, body: int) -> None:
    """Take a body out of one of PyBullet's worlds."""
    pybullet.removeBody(body, physicsClientId=client)


def quat_xyzw(rotation: np.ndarray) -> QuatXyzw:
    """Return the quaternion of a 3x3 rotation, by its roll, pitch and yaw."""
    pitch_rad = -np.arcsin(np.clip(rotation[2, 0], -1.0, 1.0))
    roll_rad = np.arctan2(rotation[2, 1], rotation[2, 2])
    yaw_rad = np.arctan2(rotation[1, 0], rotation[0, 0])
    quat: QuatXyzw = pybullet.getQuaternionFromEuler((roll_rad, pitch_rad, yaw_rad))
    return quat
