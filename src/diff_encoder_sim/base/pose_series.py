"""The poses of one source as arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class PoseSeries(NamedTuple):
    """Poses of one source in one frame, with their stamps; at least one."""

    stamps_ns: np.ndarray  # (n,) int64, as recorded
    x_y_yaw: np.ndarray  # (n, 3) [m, m, rad], finite, yaw in [-pi, pi)

    def by_time(self) -> PoseSeries:
        """Sort by stamp; of poses with the same stamp the first stays."""
        if (np.diff(self.stamps_ns) > 0).all():
            return self
        stamps_ns, rows = np.unique(self.stamps_ns, return_index=True)
        return PoseSeries(stamps_ns, self.x_y_yaw[rows])

    def path_length_m(self) -> float:
        """Sum the distances from pose to pose in the order of the stamps."""
        return float(steps_m(self.by_time().x_y_yaw).sum())


def steps_m(x_y_yaw: np.ndarray) -> np.ndarray:
    """Return the (n - 1,) distances between neighbouring poses of (n, 3)."""
    x_y_m = np.diff(x_y_yaw[:, :2], axis=0)
    # Not hypot, which differs from evo's norm in the last digit: both must find the same segments.
    return np.asarray(np.sqrt(np.square(x_y_m).sum(axis=1)))
