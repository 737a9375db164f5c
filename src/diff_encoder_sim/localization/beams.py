"""The rays of a scan that weigh the particles: a subset, in the base frame, within limits."""
from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from diff_encoder_sim.errors import InputFault
from diff_encoder_sim.localization.params import AmclParams
from diff_encoder_sim.scan import Scan
from diff_encoder_sim.se2 import Pose2D


class Beams(NamedTuple):
    """Rays in the base frame; a range of `range_max_m` stands for no return."""

    ranges_m: np.ndarray       # (k,), 0 to range_max_m
    bearings_rad: np.ndarray   # (k,) in the base frame
    laser_x_m: float           # where all rays start, in the base frame
    laser_y_m: float
    range_max_m: float

    def hits(self) -> Beams:
        """Those that returned."""
        returned = self.ranges_m < self.range_max_m
        return self._replace(ranges_m=self.ranges_m[returned],
                             bearings_rad=self.bearings_rad[returned])

    def endpoints_in_base(self) -> np.ndarray:
        """(k, 2) x, y [m] of the rays' ends."""
        return np.column_stack([self.laser_x_m + self.ranges_m * np.cos(self.bearings_rad),
                                self.laser_y_m + self.ranges_m * np.sin(self.bearings_rad)])


def beam_step(ray_count: int, max_beams: int) -> int:
    """Every how manieth ray counts. Rounded down, as upstream does: 180 of 1000 are 200."""
    return max(1, (ray_count - 1) // (max_beams - 1))


def beam_step_rounded_up(ray_count: int, max_beams: int) -> int:
    """The same for upstream's likelihood_field_prob: never more than `max_beams`."""
    return math.ceil(ray_count / max_beams)


def select_beams(scan: Scan, step: int, laser_pose_in_base: Pose2D, params: AmclParams) -> Beams:
    """Each step-th ray that is a number.

    Readings at or below the least range become no return, as upstream treats them; so do those
    at or beyond the largest, infinity included.

    Raises:
        InputFault: the scan's range limit is none.
    """
    range_max_m, range_min_m = float(scan.range_max_m), float(scan.range_min_m)
    if params.laser_max_range > 0.0:
        range_max_m = min(range_max_m, params.laser_max_range)
    if params.laser_min_range > 0.0:
        range_min_m = max(range_min_m, params.laser_min_range)
    if not (0.0 < range_max_m < math.inf):
        raise InputFault(f'scan: given a range limit of {range_max_m} m; '
                         'expected a finite number greater than 0')
    ranges_m = np.asarray(scan.ranges_m[::step], dtype=float)
    bearings_rad = scan.angle_min_rad + scan.angle_increment_rad * step * np.arange(len(ranges_m))
    is_number = ~np.isnan(ranges_m)
    ranges_m = ranges_m[is_number]
    no_return = (ranges_m <= range_min_m) | (ranges_m > range_max_m)
    return Beams(np.where(no_return, range_max_m, ranges_m),
                 laser_pose_in_base.yaw_rad + bearings_rad[is_number],
                 laser_pose_in_base.x_m, laser_pose_in_base.y_m, range_max_m)


def check_scan(scan: Scan) -> None:
    """Refuse a scan that has no rays, or none with a direction.

    Raises:
        InputFault: as said.
    """
    if np.ndim(scan.ranges_m) != 1 or len(scan.ranges_m) == 0:
        raise InputFault(f'scan: given {np.size(scan.ranges_m)} ranges; expected at least one')
    if not (math.isfinite(scan.angle_min_rad) and math.isfinite(scan.angle_increment_rad)):
        raise InputFault(f'scan: given bearings from {scan.angle_min_rad} in steps of '
                         f'{scan.angle_increment_rad} rad; expected finite numbers')
    if len(scan.ranges_m) > 1 and scan.angle_increment_rad == 0.0:
        raise InputFault(f'scan: given {len(scan.ranges_m)} rays in one direction '
                         '(angle_increment 0); expected each in its own')


def nothing_seen(scan: Scan, beams: Beams) -> InputFault:
    """The fault of a scan that cannot tell one place from another."""
    return InputFault(f'scan: none of {len(scan.ranges_m)} rays, of those used, returned from '
                      f'within {beams.range_max_m:g} m: nothing to locate the robot by')
