"""Whether the robot is where the filter says: a verdict over some scans, one way and the other."""

from __future__ import annotations

from typing import Optional

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.scan_fit import FitMap
from diff_encoder_sim.mapping.occupancy_grid import OccupancyGrid


class LostDetector:
    """Lost after lost_scans bad scans in a row, found after as many good ones.

    A wrong place near by may fit half of a scan. So to be found takes more than not to be lost:
    a share halfway from lost_fraction to 1.
    """

    def __init__(self, params: AmclParams, grid: OccupancyGrid) -> None:
        self._map = FitMap(grid, params.lost_distance) if params.lost_fraction > 0.0 else None
        self._lost_fraction, self._lost_scans = params.lost_fraction, params.lost_scans
        self.is_lost = False
        self.fit_fraction: Optional[float] = None  # of the newest scan that allowed a verdict
        self._against = 0  # scans in a row that contradict is_lost

    @property
    def least_fraction(self) -> float:
        """What a good scan's share must have now."""
        return 0.5 * (self._lost_fraction + 1.0) if self.is_lost else self._lost_fraction

    def check(self, base_pose_in_map: Pose2D, scan: Scan, laser_pose_in_base: Pose2D, may_be_found: bool) -> None:
        """Take a scan.

        Args:
            base_pose_in_map: where the filter puts the robot at the scan's stamp.
            scan: its rays without a return, and those that end off the map, do not count.
            laser_pose_in_base: where the laser is mounted.
            may_be_found: False while the filter cannot know where it is.

        Raises:
            InputFault: the scan's range limit is none.
        """
        if self._map is None:
            return
        share = self._map.fit(base_pose_in_map, scan, laser_pose_in_base).fraction
        if share is None:
            return
        self.fit_fraction = share
        is_good = share >= self.least_fraction and (may_be_found or not self.is_lost)
        self._against = self._against + 1 if is_good == self.is_lost else 0
        if self._against >= self._lost_scans:
            self.is_lost, self._against = not self.is_lost, 0

    def declare_lost(self) -> None:
        """Somebody says that the robot may be anywhere."""
        self.is_lost, self._against = self._map is not None, 0

    def start_counting_again(self) -> None:
        """The filter begins elsewhere: what scans said before was not about that."""
        self._against = 0
