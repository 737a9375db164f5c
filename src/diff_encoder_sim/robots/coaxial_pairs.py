"""Two wheels on one axle, by geometry."""

from __future__ import annotations

from itertools import combinations
from typing import Iterable, List, NamedTuple

import numpy as np

from diff_encoder_sim.robots.rolling_wheels import RollingWheel

PARALLEL = 0.995  # cosine
OFF_LINE = 0.1  # of the radius: how far a wheel may be off the other's axis
LIKE_RADIUS = 0.05
LEAST_SEPARATION = 0.2  # of the radius


class WheelPair(NamedTuple):
    """Two wheels, the left one at the larger y."""

    left: RollingWheel
    right: RollingWheel

    @property
    def joints(self) -> List[str]:
        """Return the joints' names, left first."""
        return [self.left.joint, self.right.joint]

    @property
    def radius_m(self) -> float:
        """Return the mean radius."""
        return 0.5 * ((self.left.radius_m or 0.0) + (self.right.radius_m or 0.0))


def coaxial_pairs(wheels: Iterable[RollingWheel]) -> List[WheelPair]:
    """Return all pairs of like wheels on one axle; of three on one axle, three pairs."""
    return [left_first(a, b) for a, b in combinations(wheels, 2) if are_coaxial(a, b)]


def left_first(a: RollingWheel, b: RollingWheel) -> WheelPair:
    """Return two wheels as a pair."""
    return WheelPair(a, b) if a.centre_m[1] >= b.centre_m[1] else WheelPair(b, a)


def are_parallel(a: RollingWheel, b: RollingWheel) -> bool:
    """Return whether the axes of two wheels are parallel."""
    return bool(abs(a.axis @ b.axis) > PARALLEL)


def are_coaxial(a: RollingWheel, b: RollingWheel) -> bool:
    """Return whether two wheels have one axis and one radius, side by side."""
    apart_m, larger_m = b.centre_m - a.centre_m, max(a.radius_m or 0.0, b.radius_m or 0.0)
    return bool(
        are_parallel(a, b)
        and np.linalg.norm(np.cross(apart_m, a.axis)) < OFF_LINE * larger_m
        and abs(apart_m @ a.axis) > LEAST_SEPARATION * larger_m
        and abs((a.radius_m or 0.0) - (b.radius_m or 0.0)) <= LIKE_RADIUS * larger_m
    )
