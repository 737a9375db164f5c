"""References: poses of a sensor that does not depend on the wheels, with their covariances, from a bag or a table."""

from __future__ import annotations

import math
from typing import List, NamedTuple, Optional, Tuple

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D, wrap_angles
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.csv_table import CsvStream, row_numbers
from diff_encoder_sim.drives.message_decoders import StampedPose
from diff_encoder_sim.drives.recorded_poses import RecordedPoses
from diff_encoder_sim.drives.wheel_source import ascending_runs, repeated_stamps

# A reference pose that is older than the newest by no more than this was overtaken by another message: it is dropped.
OVERTAKEN_NS = NANOSECONDS_PER_SECOND


class Reference(NamedTuple):
    """Poses of a sensor on the robot in a fixed frame."""

    name: str  # topic, frames or file
    stamps_ns: np.ndarray  # (k,) int64, strictly increasing, by the clock of the reference
    poses: np.ndarray  # (k, 3) x [m], y [m], yaw [rad] in [-pi, pi); yaw is NaN if the reference has positions only
    # (k, 3, 3) of x, y and yaw [m^2, m rad, rad^2] as the source states them, NaN in row and column of an unknown yaw;
    # None unless all are positive definite.
    covariances: Optional[np.ndarray] = None
    scale_std: float = 0.0  # of all its distances together, relative


def read_reference(poses: RecordedPoses) -> Tuple[List[Reference], List[str]]:
    """Return the parts of increasing stamps of recorded poses, and notes on what of them is not used."""
    stamps_ns, x_y_yaw = poses.series()
    covariances, notes = poses.covariances(), [f'reference: {poses.fault}'] if poses.fault else []
    if covariances is not None and not _are_definite(covariances):
        if covariances.any():
            notes.append('reference: covariances that are not all positive definite: ignored')
        covariances = None
    repeated = repeated_stamps(stamps_ns)
    if repeated:
        notes.append(f'reference: {repeated} of {len(stamps_ns)} poses repeat a stamp: using the first of each')
    parts = []
    for rows in ascending_runs(stamps_ns, OVERTAKEN_NS):
        wrapped = np.column_stack((x_y_yaw[rows, :2], wrap_angles(x_y_yaw[rows, 2])))
        of_rows = None if covariances is None else covariances[rows]
        parts.append(Reference(poses.name, stamps_ns[rows], wrapped, of_rows))
    return parts, notes


def _are_definite(covariances: np.ndarray) -> bool:
    """Return whether all (n, 3, 3), or their part of x and y if yaw is unknown, are finite and positive definite."""
    known = covariances[:, :2, :2] if np.isnan(covariances[:, 2, 2]).all() else covariances
    return bool(np.isfinite(known).all() and (np.linalg.eigvalsh(known) > 0.0).all())


class TablePoses(RecordedPoses):
    """The poses in the columns X, Y and, if given, YAW of a table; further columns are their covariance."""

    def __init__(self, table: CsvStream, has_yaw: bool, length_m: float, angle_rad: float) -> None:
        """Read a table with lengths in units of `length_m`, and angles in units of `angle_rad`."""
        super().__init__(table.path.name, ())
        for message in table.messages(table.topics):
            x, y, *others = row_numbers(message)
            yaw_rad = angle_rad * others.pop(0) if has_yaw else math.nan
            pose = Pose2D(length_m * x, length_m * y, yaw_rad)
            if others and not has_yaw:
                others = [*others[:2], math.nan, others[2], math.nan, math.nan]  # XX XY YY
            units = (length_m**2, length_m**2, length_m * angle_rad, length_m**2, length_m * angle_rad, angle_rad**2)
            covariance = [unit * other for unit, other in zip(units, others)]
            self._append(StampedPose(message.time_ns, pose, '', ''), message.time_ns, covariance)
        self.fault = table.fault
