"""The rays of a scan as the mapper uses them: where they ended, and how far all is free."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.beams import check_scan
from diff_encoder_sim.localization.slam_params import GridSlamParams

# Upstream's margin below the scan's own limit, where maxRange is not given [m].
RANGE_MARGIN_M = 0.01


class Rays(NamedTuple):
    """The usable rays of one scan, in the base frame."""

    bearings_rad: np.ndarray  # (n,)
    lengths_m: np.ndarray  # (n,) to the end, or to where they are cut
    is_hit: np.ndarray  # (n,) bool: an obstacle is at the end
    is_matched: np.ndarray  # (n,) bool: hits that scan matching uses
    laser_x_m: float  # where all rays start, in the base frame
    laser_y_m: float

    def matched_ends_m(self) -> np.ndarray:
        """Return (k, 2) x, y [m] in the base frame of the ends to match."""
        bearings_rad, lengths_m = self.bearings_rad[self.is_matched], self.lengths_m[self.is_matched]
        x_m = self.laser_x_m + lengths_m * np.cos(bearings_rad)
        y_m = self.laser_y_m + lengths_m * np.sin(bearings_rad)
        return np.column_stack([x_m, y_m])

    def reach_m(self) -> float:
        """Return an upper bound [m] of the ends' distance from the base."""
        longest_m = float(self.lengths_m.max()) if len(self.lengths_m) else 0.0
        return math.hypot(self.laser_x_m, self.laser_y_m) + longest_m


def usable_rays(scan: Scan, laser_pose_in_base: Pose2D, params: GridSlamParams) -> Rays:
    """Sort a scan's rays as upstream does.

    A ray beyond maxRange is ignored; one beyond maxUrange shows that all up to there is free. +inf
    (nothing within range_max, REP-117) counts as a reading of range_max: so free space appears in
    the open where maxUrange < range_max <= maxRange, as upstream's manual describes. Upstream
    reads a range that is too close to measure as range_max; here it is ignored.

    Raises:
        InputFault: the scan has no rays, no directions or no range limit.
    """
    check_scan(scan)
    range_max_m = _range_max_m(scan)
    max_range_m = params.maxRange or range_max_m - RANGE_MARGIN_M
    usable_m = min(params.maxUrange or max_range_m, max_range_m)
    ranges_m = np.asarray(scan.ranges_m, dtype=float)
    ranges_m = np.where(ranges_m == math.inf, range_max_m, ranges_m)
    # NaN compares as false.
    with np.errstate(invalid='ignore'):
        is_used = (ranges_m > 0.0) & (ranges_m >= scan.range_min_m) & (ranges_m <= max_range_m)
        is_hit = is_used & (ranges_m < usable_m) & (ranges_m < range_max_m)
    is_matched = is_hit & (np.arange(len(ranges_m)) % (params.lskip + 1) == 0)
    bearings_rad = laser_pose_in_base.yaw_rad + scan.bearings_rad()[is_used]
    lengths_m = np.minimum(ranges_m[is_used], usable_m)
    laser_m = laser_pose_in_base.x_m, laser_pose_in_base.y_m
    return Rays(bearings_rad, lengths_m, is_hit[is_used], is_matched[is_used], *laser_m)


def _range_max_m(scan: Scan) -> float:
    range_max_m = float(scan.range_max_m)
    if not 0.0 < range_max_m < math.inf:
        raise InputFault(f'range_max {range_max_m} m; expected a finite number greater than 0')
    return range_max_m
