"""Lost detection: whether the robot is where the filter estimates it, decided over some scans.

Decision and measurements: docs/adr/0006-lost-detection.md.
"""

from __future__ import annotations

from typing import Optional

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.localization.scan_fit import FitMap


class LostDetector:
    """Lost after lost_scans bad scans in a row, found after as many good ones.

    A wrong place near by may fit half of a scan. So to be found takes more than not to be lost:
    a fraction halfway from lost_fraction to 1.
    """

    def __init__(self, params: AmclParams, grid: OccupancyGrid) -> None:
        self._map = FitMap(grid, params.lost_distance) if params.lost_fraction > 0.0 else None
        self._lost_fraction, self._lost_scans = params.lost_fraction, params.lost_scans
        self.is_lost = False
        self.fit_fraction: Optional[float] = None  # of the newest scan with enough rays to decide by
        self._against = 0  # scans in a row that contradict is_lost

    @property
    def least_fraction(self) -> float:
        """The least fit_fraction of a good scan: more while lost than otherwise."""
        return 0.5 * (self._lost_fraction + 1.0) if self.is_lost else self._lost_fraction

    def check(self, base_pose_in_map: Pose2D, scan: Scan, laser_pose_in_base: Pose2D, may_be_found: bool) -> None:
        """Compare one more scan with the map, and update is_lost.

        Args:
            base_pose_in_map: where the filter puts the robot at the scan's stamp.
            scan: its rays without a return, and those that end off the map, do not count.
            laser_pose_in_base: where the laser is mounted.
            may_be_found: False while the filter cannot know where it is.

        Raises:
            InputFault: the scan has an invalid range limit.
        """
        if self._map is None:
            return
        fraction = self._map.fit(base_pose_in_map, scan, laser_pose_in_base).fraction
        if fraction is None:
            return
        self.fit_fraction = fraction
        is_good = fraction >= self.least_fraction and (may_be_found or not self.is_lost)
        self._against = self._against + 1 if is_good == self.is_lost else 0
        if self._against >= self._lost_scans:
            self.is_lost, self._against = not self.is_lost, 0

    def declare_lost(self) -> None:
        """Count the robot as lost, until scans show otherwise."""
        self.is_lost, self._against = self._map is not None, 0

    def restart_count(self) -> None:
        """Forget the scans so far: they were compared with another estimate."""
        self._against = 0
