"""What is asked of a robot at the end of its tests."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D


class Requirement(NamedTuple):
    """So many of all trials are to end so near."""

    share: float  # of trials, 0 to 1
    position_m: float  # in x and in y
    yaw_rad: float
    confidence: float  # of answers

    @property
    def tolerances(self) -> np.ndarray:
        """Return (3,) the allowed absolute errors in x [m], y [m] and yaw [rad]."""
        return np.array([self.position_m, self.position_m, self.yaw_rad])

    def within(self, errors: np.ndarray) -> np.ndarray:
        """Return (n,) which of (n, 3) errors are allowed; NaN is not."""
        is_within: np.ndarray = (np.abs(errors) <= self.tolerances).all(axis=1)
        return is_within

    def __str__(self) -> str:
        return (
            f'at least {100 * self.share:g} % of the trials within {self.position_m:g} m in x and y and '
            f'{math.degrees(self.yaw_rad):g} degrees'
        )


def along_goal(errors: np.ndarray, goal_in_map: Pose2D) -> np.ndarray:
    """Turn (n, 3) errors from the map's axes to those along the heading at the goal and across it, to the left."""
    cos, sin = math.cos(goal_in_map.yaw_rad), math.sin(goal_in_map.yaw_rad)
    x_m, y_m, yaw_rad = errors.T
    return np.column_stack([cos * x_m + sin * y_m, cos * y_m - sin * x_m, yaw_rad])
