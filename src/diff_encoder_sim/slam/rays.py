"""What a scan tells the mapper: where rays ended, and how far they saw nothing."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.beams import check_scan
from diff_encoder_sim.slam.slam_params import GridSlamParams

# Upstream's margin below the scan's own limit, where maxRange is not given [m].
RANGE_MARGIN_M = 0.01


class Rays(NamedTuple):
    """Rays of one scan in the base frame, those that tell something."""

    bearings_rad: np.ndarray  # (n,)
    lengths_m: np.ndarray  # (n,) to the end, or to where they are cut
    is_hit: np.ndarray  # (n,) bool: something is at the end
    is_matched: np.ndarray  # (n,) bool: hits that scan matching looks at
    laser_x_m: float  # where all rays start, in the base frame
    laser_y_m: float

    def matched_ends_m(self) -> np.ndarray:
        """(k, 2) x, y [m] in the base frame of the ends to match."""
        bearings_rad = self.bearings_rad[self.is_matched]
        lengths_m = self.lengths_m[self.is_matched]
        return np.column_stack(
            [self.laser_x_m + lengths_m * np.cos(bearings_rad), self.laser_y_m + lengths_m * np.sin(bearings_rad)]
        )

    def reach_m(self) -> float:
        """How far from the base the farthest end is."""
        return math.hypot(self.laser_x_m, self.laser_y_m) + (
            float(self.lengths_m.max()) if len(self.lengths_m) else 0.0
        )


def usable_rays(scan: Scan, laser_pose_in_base: Pose2D, params: GridSlamParams) -> Rays:
    """Sort a scan's rays as upstream does.

    A ray beyond maxRange says nothing; one beyond maxUrange that all up to there is free. Of +inf
    (nothing within range_max, REP-117) the same is said as of a reading of range_max: so free space
    shows in the open where maxUrange < range_max <= maxRange, as upstream's manual has it. Upstream
    reads what is too close to measure as range_max; here it says nothing.

    Raises:
        InputFault: the scan has no rays, no directions or no range limit.
    """
    check_scan(scan)
    range_max_m = float(scan.range_max_m)
    if not 0.0 < range_max_m < math.inf:
        raise InputFault(f'scan: given a range limit of {range_max_m} m; expected a finite number greater than 0')
    max_range_m = params.maxRange or range_max_m - RANGE_MARGIN_M
    usable_m = min(params.maxUrange or max_range_m, max_range_m)
    ranges_m = np.asarray(scan.ranges_m, dtype=float)
    ranges_m = np.where(ranges_m == math.inf, range_max_m, ranges_m)
    # NaN compares as false.
    with np.errstate(invalid='ignore'):
        tells = (ranges_m > 0.0) & (ranges_m >= scan.range_min_m) & (ranges_m <= max_range_m)
        is_hit = tells & (ranges_m < usable_m) & (ranges_m < range_max_m)
    is_matched = is_hit & (np.arange(len(ranges_m)) % (params.lskip + 1) == 0)
    return Rays(
        laser_pose_in_base.yaw_rad + scan.bearings_rad()[tells],
        np.minimum(ranges_m[tells], usable_m),
        is_hit[tells],
        is_matched[tells],
        laser_pose_in_base.x_m,
        laser_pose_in_base.y_m,
    )
