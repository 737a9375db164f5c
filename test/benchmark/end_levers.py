"""What errors of the odometry on the way do to its final pose, to first order."""

from __future__ import annotations

import math

import numpy as np


class EndLevers:
    """Of a drive: how the odometry's final pose changes with a step that seems longer or turns more than it does.

    Attributes:
        lengths_m: (n,) signed length of each step.
        turns_rad: (n,) its turn.
        by_length: (n, 3) change of the final x [m], y [m] and yaw [rad] per metre.
        by_heading: (n, 3) the same per radian.
    """

    def __init__(self, truth: np.ndarray) -> None:
        """Take (n + 1, 3) true poses on the way, x [m], y [m], yaw [rad]."""
        steps = np.diff(truth, axis=0)
        self.turns_rad = (steps[:, 2] + math.pi) % (2.0 * math.pi) - math.pi
        middle = truth[:-1] + 0.5 * np.column_stack((steps[:, :2], self.turns_rad))
        cos_yaw, sin_yaw, ones = np.cos(middle[:, 2]), np.sin(middle[:, 2]), np.ones(len(steps))
        self.lengths_m = steps[:, 0] * cos_yaw + steps[:, 1] * sin_yaw
        # A metre more shifts the end; a radian more turns it about where the robot then is.
        self.by_length = np.column_stack((cos_yaw, sin_yaw, 0.0 * ones))
        self.by_heading = np.column_stack((middle[:, 1] - truth[-1, 1], truth[-1, 0] - middle[:, 0], ones))
