"""A drive: stamps, wheel angles and poses of a robot, the input of encoder and odometry simulation.

A simulated trial, a bag or a table produces one; `wheels.chain` turns it into counts and odometry.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np


@dataclass(frozen=True)
class Drive:
    """Samples of both wheels and, if known, the poses of the robot at the same stamps.

    Attributes:
        stamps_ns: (n,) int64, strictly increasing [ns].
        wheel_angles_rad: (n, 2), accumulated angles of the left and right wheel [rad], not wrapped; or (draws, n, 2)
            for robots with different wheels on the same path.
        true_poses: (n, 3) x [m], y [m], yaw [rad] of the base in a fixed frame, or None if the drive has no reference.
    """

    stamps_ns: np.ndarray
    wheel_angles_rad: np.ndarray
    true_poses: Optional[np.ndarray] = None

    def __post_init__(self) -> None:
        """Raise ValueError if the arrays do not have these shapes; sources check the values of their input."""
        samples = len(self.stamps_ns)
        if self.wheel_angles_rad.shape[-2:] != (samples, 2) or self.wheel_angles_rad.ndim > 3:
            raise ValueError(f'wheel angles of shape {self.wheel_angles_rad.shape}, not ({samples}, 2)')
        if self.true_poses is not None and self.true_poses.shape != (samples, 3):
            raise ValueError(f'true poses of shape {self.true_poses.shape}, not ({samples}, 3)')

    def __len__(self) -> int:
        return len(self.stamps_ns)
