"""The solids that a robot can reach soon: only these are in the physics, as each costs time in every step."""

from __future__ import annotations

from typing import Callable, Dict, List, Sequence

import numpy as np

from diff_encoder_sim.robots.robot_tree import Box, Cylinder, Sphere
from diff_encoder_sim.simulation.bullet_shapes import add_body, add_shape, remove_body
from diff_encoder_sim.simulation.world import Solid

# How far beyond the robot's reach solids are in the physics, and how far it may drive until they are looked at again:
# what is left over is for what drives on while the wheels are told to stop.
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
        boxes_m = np.array([_box_m(solid) for solid in solids]).reshape(-1, 2, 2)
        self._low_m, self._high_m = boxes_m[:, 0], boxes_m[:, 1]
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
            remove_body(self._client, body)
        for index in sorted(near - self._bodies.keys()):
            body = self._bodies[index] = add_body(self._client, self._shapes[index], self._solids[index])
            self.names[body] = self._solids[index].name
            self._on_added(body)


def _box_m(solid: Solid) -> List[np.ndarray]:
    """Return the lowest and highest x and y [m] of a solid's bounding box in the world."""
    shape = solid.shape
    if isinstance(shape, Box):
        half_m = 0.5 * np.array(shape.size_xyz_m)
    elif isinstance(shape, Cylinder):
        half_m = np.array([shape.radius_m, shape.radius_m, 0.5 * shape.length_m])
    else:
        assert isinstance(shape, Sphere)
        half_m = np.full(3, shape.radius_m)
    centre_m = solid.pose_in_world[:3, 3]
    reach_m = np.abs(solid.pose_in_world[:3, :3]) @ half_m
    return [(centre_m - reach_m)[:2], (centre_m + reach_m)[:2]]
