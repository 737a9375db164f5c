"""The interface of the laser models: built for one map, a model weighs particles by a scan."""

from __future__ import annotations

import abc
from typing import NamedTuple

import numpy as np

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.beams import Beams, beam_step, check_scan, no_return_fault, select_beams
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid


class Likelihoods(NamedTuple):
    """The likelihood of a scan for each particle: factors[i] * exp(log_scale).

    In two parts, because a product over 180 beams need not fit a double.
    """

    factors: np.ndarray  # (n,), 0 or more
    log_scale: float


class SensorModel(abc.ABC):
    """A laser model on one map."""

    # The likelihood fields ignore rays without a return.
    _hits_only = True

    def __init__(self, params: AmclParams, grid: OccupancyGrid) -> None:
        self._params = params
        self._grid = grid

    def beams(self, scan: Scan, laser_pose_in_base: Pose2D) -> Beams:
        """Select the rays of a scan that count.

        Raises:
            InputFault: none does, or the scan is invalid.
        """
        check_scan(scan)
        beams = select_beams(scan, self._step(len(scan.ranges_m)), laser_pose_in_base, self._params, self._hits_only)
        if len(beams.ranges_m) == 0:
            raise no_return_fault(scan, beams)
        return beams

    def _step(self, ray_count: int) -> int:
        """Return the step between the rays that count."""
        return beam_step(ray_count, self._params.laser_max_beams)

    @abc.abstractmethod
    def likelihoods(self, particles: np.ndarray, beams: Beams, converged: bool) -> Likelihoods:
        """Weigh particles (n, 3), base poses in the map, by a scan's beams.

        Args:
            particles: x [m], y [m], yaw [rad].
            beams: from `beams`.
            converged: whether the particles lie close together.
        """

    def _poses_in_cells(self, particles: np.ndarray) -> np.ndarray:
        """Return (n, 4): particles as column, row (with fractions), cosine and sine in the grid's frame.

        Cell (row, column) covers [column, column + 1) x [row, row + 1), as nav_msgs/OccupancyGrid
        means it. Upstream rounds to the nearest cell instead, which puts its map half a cell off,
        and leaves out the origin's yaw.
        """
        origin, cell_m = self._grid.origin, self._grid.resolution_m
        cos_origin, sin_origin = np.cos(origin.yaw_rad), np.sin(origin.yaw_rad)
        x_m, y_m = particles[:, 0] - origin.x_m, particles[:, 1] - origin.y_m
        yaw_rad = particles[:, 2] - origin.yaw_rad
        columns = (cos_origin * x_m + sin_origin * y_m) / cell_m
        rows = (cos_origin * y_m - sin_origin * x_m) / cell_m
        return np.column_stack([columns, rows, np.cos(yaw_rad), np.sin(yaw_rad)])
