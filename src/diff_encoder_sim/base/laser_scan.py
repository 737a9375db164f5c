"""One scan of a planar laser scanner."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Scan(NamedTuple):
    """Ranges over equally spaced bearings in the laser's frame (sensor_msgs/LaserScan)."""

    stamp_ns: int  # of the first ray
    angle_min_rad: float  # bearing of the first ray, counter-clockwise
    angle_increment_rad: float  # between rays
    range_min_m: float
    range_max_m: float
    ranges_m: np.ndarray  # (n,); +inf without return, out of range if invalid

    def bearings_rad(self) -> np.ndarray:
        """Return the (n,) bearing of each ray in the laser's frame."""
        return self.angle_min_rad + self.angle_increment_rad * np.arange(len(self.ranges_m))
