"""The rays of a scan that weigh the particles: a subset, in the base frame, within limits; and checks of scans."""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.kernels import Array, compiled
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.amcl_params import AmclParams


class Beams(NamedTuple):
    """Rays in the base frame; a range of `range_max_m` stands for no return."""

    ranges_m: np.ndarray  # (k,), 0 to range_max_m
    bearings_rad: np.ndarray  # (k,) in the base frame
    laser_x_m: float  # where all rays start, in the base frame
    laser_y_m: float
    range_max_m: float

    def endpoints_in_base(self) -> np.ndarray:
        """Return (k, 2) x, y [m] of the rays' ends."""
        return np.column_stack(
            [
                self.laser_x_m + self.ranges_m * np.cos(self.bearings_rad),
                self.laser_y_m + self.ranges_m * np.sin(self.bearings_rad),
            ]
        )


def select_beams(scan: Scan, step: int, laser_pose_in_base: Pose2D, params: AmclParams, hits_only: bool) -> Beams:
    """Select each step-th ray that is a number, or of those only the rays that returned.

    Readings at or below the least range become no return, as upstream treats them; so do those
    at or beyond the largest, infinity included.

    Raises:
        InputFault: the scan has an invalid range limit.
    """
    range_max_m, range_min_m = float(scan.range_max_m), float(scan.range_min_m)
    if params.laser_max_range > 0.0:
        range_max_m = min(range_max_m, params.laser_max_range)
    if params.laser_min_range > 0.0:
        range_min_m = max(range_min_m, params.laser_min_range)
    check_range_max(range_max_m)
    if not (0.0 <= range_min_m < math.inf):
        raise InputFault(f'range_min {range_min_m} m; expected a finite number of at least 0')
    # A copy, whatever the scan's array is like: the kernel is compiled for one kind of array.
    ranges_m, bearings_rad = _rays_in_base(
        np.array(scan.ranges_m[::step], dtype=float),
        range_min_m,
        range_max_m,
        hits_only,
        scan.angle_min_rad,
        scan.angle_increment_rad * step,
        laser_pose_in_base.yaw_rad,
    )
    return Beams(ranges_m, bearings_rad, laser_pose_in_base.x_m, laser_pose_in_base.y_m, range_max_m)


@compiled
def _rays_in_base(
    ranges_m: Array,
    range_min_m: float,
    range_max_m: float,
    hits_only: bool,
    first_rad: float,
    step_rad: float,
    laser_yaw_rad: float,
) -> Tuple[np.ndarray, np.ndarray]:
    """Return (k,) ranges and (k,) bearings in the base frame of the rays (n,) that are numbers."""
    kept_m, bearings_rad = np.empty(len(ranges_m)), np.empty(len(ranges_m))
    count = 0
    for ray in range(len(ranges_m)):
        range_m = ranges_m[ray]
        if range_m <= range_min_m or range_m > range_max_m:
            range_m = range_max_m
        if math.isnan(range_m) or (hits_only and range_m >= range_max_m):
            continue
        kept_m[count] = range_m
        bearings_rad[count] = laser_yaw_rad + (first_rad + step_rad * ray)
        count += 1
    return kept_m[:count], bearings_rad[:count]


def check_range_max(range_max_m: float) -> None:
    """Refuse a scan without a limit of its ranges.

    Raises:
        InputFault: the limit is not a finite number greater than 0.
    """
    if not 0.0 < range_max_m < math.inf:
        raise InputFault(f'range_max {range_max_m} m; expected a finite number greater than 0')


def check_scan(scan: Scan) -> None:
    """Refuse a scan without rays or without a direction for each.

    Raises:
        InputFault: no rays, bearings that are not finite, or all rays in one direction.
    """
    count, first_rad, step_rad = len(scan.ranges_m), scan.angle_min_rad, scan.angle_increment_rad
    if count == 0 or not math.isfinite(first_rad + step_rad * count) or (count > 1 and step_rad == 0.0):
        raise InputFault(
            f'{count} ranges from angle_min {first_rad} by angle_increment {step_rad} rad; expected at least one, '
            'each in a different direction'
        )
