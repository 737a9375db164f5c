"""The paths of the particles, as a tree: those resampled from one particle share their past."""

from __future__ import annotations

from typing import List, NamedTuple

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D


class TrajectoryPose(NamedTuple):
    """The pose of the base when a scan was entered into the map."""

    stamp_ns: int
    base_pose_in_map: Pose2D


class History:
    """Poses of all particles at each update, and each one's parent in the update before."""

    def __init__(self) -> None:
        self._stamps_ns: List[int] = []
        self._poses: List[np.ndarray] = []
        self._parents: List[np.ndarray] = []

    def add(self, stamp_ns: int, particles: np.ndarray, parents: np.ndarray) -> None:
        """Append an update: (n, 3) poses, and (n,) the index that each particle had before it."""
        self._stamps_ns.append(stamp_ns)
        self._poses.append(particles)
        self._parents.append(parents)

    def path(self, particle: int) -> List[TrajectoryPose]:
        """Return the poses of a particle of the newest update, oldest first."""
        path = []
        for stamp_ns, poses, parents in zip(reversed(self._stamps_ns), reversed(self._poses), reversed(self._parents)):
            path.append(TrajectoryPose(stamp_ns, Pose2D(*poses[particle].tolist())))
            particle = int(parents[particle])
        return path[::-1]
