"""PyBullet: loaded when needed, its shapes, and the solids near the robot."""

from __future__ import annotations

import contextlib
import ctypes
import importlib
import os
import sys
from typing import Any, Callable, Dict, Iterator, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.solids import Box, Cylinder, Shape, Sphere, reach_m
from diff_encoder_sim.simulation.world import Plane, Solid

# PyBullet's version decides which of the two the line goes to.
STDOUT, STDERR = 1, 2


@contextlib.contextmanager
def silence(*descriptors: int) -> Iterator[None]:
    """Silence file descriptors, as the line comes from C's printf, past sys.stdout."""
    sys.stdout.flush()
    sys.stderr.flush()
    flush_c = ctypes.CDLL(None).fflush
    flush_c(None)
    kept = [os.dup(descriptor) for descriptor in descriptors]
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        for descriptor in descriptors:
            os.dup2(nowhere, descriptor)
        yield
    finally:
        flush_c(None)
        for descriptor, copy in zip(descriptors, kept):
            os.dup2(copy, descriptor)
            os.close(copy)
        os.close(nowhere)


def _import_quietly(name: str) -> Any:
    try:
        with silence(STDOUT, STDERR):
            return importlib.import_module(name)
    except ModuleNotFoundError:
        raise ConfigError(
            'PyBullet, which simulates the robot, is not installed; allowed: pip install pybullet (a minute on Python '
            '3.8 to 3.11, which have wheels; newer ones build it from source, with a C++ compiler in ten minutes, as '
            'the extra [sim] does)'
        ) from None


pybullet = deferred('pybullet', _import_quietly)

QuatXyzw = Tuple[float, float, float, float]


def add_shape(client: int, solid: Solid) -> int:
    """Make a solid's collision shape in one of PyBullet's worlds, and return its number."""
    shape, arguments = solid.shape, {'shapeType': pybullet.GEOM_PLANE}
    if isinstance(shape, Box):
        arguments = {'shapeType': pybullet.GEOM_BOX, 'halfExtents': [0.5 * length_m for length_m in shape.size_xyz_m]}
    elif isinstance(shape, Cylinder):
        arguments = {'shapeType': pybullet.GEOM_CYLINDER, 'radius': shape.radius_m, 'height': shape.length_m}
    elif isinstance(shape, Sphere):
        arguments = {'shapeType': pybullet.GEOM_SPHERE, 'radius': shape.radius_m}
    return int(pybullet.createCollisionShape(physicsClientId=client, **arguments))


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


def quat_xyzw(rotation: np.ndarray) -> QuatXyzw:
    """Return the quaternion of a 3x3 rotation, by its roll, pitch and yaw."""
    pitch_rad = -np.arcsin(np.clip(rotation[2, 0], -1.0, 1.0))
    roll_rad = np.arctan2(rotation[2, 1], rotation[2, 2])
    yaw_rad = np.arctan2(rotation[1, 0], rotation[0, 0])
    quat: QuatXyzw = pybullet.getQuaternionFromEuler((roll_rad, pitch_rad, yaw_rad))
    return quat


# How far beyond the robot's reach solids are in the physics, and how far it may drive until they are looked at again:
# what is left over is for a robot that still moves while its wheels are commanded to stop.
AHEAD_M, LOOK_AGAIN_M = 1.0, 0.5


class NearSolids:
    """Keeps the bodies of the near solids in one of PyBullet's worlds."""

    def __init__(self, client: int, solids: Sequence[Solid], on_added: Callable[[int], None]) -> None:
        """Prepare the solids; none is in the physics yet.

        Args:
            client: PyBullet's world.
            solids: those that may be touched.
            on_added: called with the number of each new body.
        """
        self._client, self._solids, self._on_added = client, solids, on_added
        self._shapes = [add_shape(client, solid) for solid in solids]
        shapes = [Shape(each.shape, each.pose_in_world) for each in solids if not isinstance(each.shape, Plane)]
        ways = -np.eye(3)[:2], np.eye(3)[:2]
        reaches_m = [[[reach_m([shape], way) for way in two] for two in ways] for shape in shapes]
        ends_m = np.array(reaches_m).reshape(-1, 2, 2) * [[[-1.0], [1.0]]]  # lowest and highest x and y
        self._low_m, self._high_m = ends_m[:, 0], ends_m[:, 1]
        self._bodies: Dict[int, int] = {}  # by index of the solid
        self.names: Dict[int, str] = {}  # of the solids in the physics, by body

    def look(self, x_m: float, y_m: float, reach_m: float) -> None:
        """Keep the solids within a distance of a place [m] in the physics, and no others."""
        place_m = np.array([x_m, y_m])
        away_m = np.maximum(np.maximum(self._low_m - place_m, place_m - self._high_m), 0.0)
        near = set(np.flatnonzero(np.hypot(*away_m.T) <= reach_m).tolist())
        for index in sorted(self._bodies.keys() - near):
            body = self._bodies.pop(index)
            del self.names[body]
            pybullet.removeBody(body, physicsClientId=self._client)
        for index in sorted(near - self._bodies.keys()):
            body = self._bodies[index] = add_body(self._client, self._shapes[index], self._solids[index])
            self.names[body] = self._solids[index].name
            self._on_added(body)
