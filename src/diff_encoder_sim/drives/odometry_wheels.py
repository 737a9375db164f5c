"""Wheel angles by inverse kinematics, from the recorded poses of odometry."""

from __future__ import annotations

from typing import Iterator, List, Tuple

import numpy as np

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.base.se2 import wrap_angles
from diff_encoder_sim.drives import wheel_source
from diff_encoder_sim.drives.drive_stream import Message
from diff_encoder_sim.drives.recorded_poses import RecordedPoses
from diff_encoder_sim.wheels.odometry_params import OdometryParams

_SIDEWAYS_FRACTION = 0.01  # per motion ahead, that is more than rounding; the wheels' axle cannot do it


class OdometryWheels(wheel_source.WheelSource):
    """Computes the rotation of the wheels of a robot without slip between one pose and the next."""

    def __init__(self, odometry: RecordedPoses, joints: Tuple[str, str], wheels: OdometryParams) -> None:
        """Prepare to read; `wheels` has diameter, separation and axle."""
        super().__init__(odometry.topics, joints, f'messages of {odometry.name} (wheel angles by inverse kinematics)')
        self._odometry, self._wheels = odometry, wheels
        self._along_m = self._sideways_m = 0.0

    def add(self, message: Message) -> None:
        """Add the poses of a message."""
        self._odometry.add(message)

    def drives(self) -> List[wheel_source.TimedDrive]:
        """Return both wheels at every pose."""
        (stamps_ns, base_poses), times_ns = self._odometry.series(), np.array(self._odometry.times_ns)
        angles_rad = self._turned_rad(base_poses)
        runs = wheel_source.ascending_runs(stamps_ns)
        return [wheel_source.TimedDrive(Drive(stamps_ns[rows], angles_rad[rows]), times_ns[rows]) for rows in runs]

    def _turned_rad(self, base_poses: np.ndarray) -> np.ndarray:
        """Return the rotation of both wheels at each of (n, 3) poses: (n, 2), by arcs between the poses."""
        cos_yaw, sin_yaw = np.cos(base_poses[:, 2]), np.sin(base_poses[:, 2])
        x_m, y_m = base_poses[:, 0] + self._wheels.axle_x * cos_yaw, base_poses[:, 1] + self._wheels.axle_x * sin_yaw
        half_turns_rad = 0.5 * wrap_angles(np.diff(base_poses[:, 2]))
        # A chord has the direction in the middle of its arc: the inverse of `move_along_arc`.
        headings_rad = base_poses[:-1, 2] + half_turns_rad
        cos_heading, sin_heading = np.cos(headings_rad), np.sin(headings_rad)
        arcs_m = (cos_heading * np.diff(x_m) + sin_heading * np.diff(y_m)) / np.sinc(half_turns_rad / np.pi)
        self._along_m = float(np.abs(arcs_m).sum())
        self._sideways_m = float(np.abs(cos_heading * np.diff(y_m) - sin_heading * np.diff(x_m)).sum())
        apart_m = half_turns_rad * self._wheels.wheel_separation
        turns_rad = np.column_stack((arcs_m - apart_m, arcs_m + apart_m)) / self._wheels.wheel_diameter.radii_m
        return np.concatenate((np.zeros((1, 2)), np.cumsum(turns_rad, axis=0)))[: len(base_poses)]

    def notes(self) -> Iterator[str]:
        """List the limits of poses."""
        name = self._odometry.name
        yield f'the wheel angles are those of the poses of {name}, with slip and the rounding of the recorded encoder'
        if self._sideways_m > _SIDEWAYS_FRACTION * self._along_m:
            sideways = f'{self._sideways_m:.2f} m sideways on {self._along_m:.2f} m ahead'
            yield f'{name} moves {sideways}, which two wheels on an axle cannot do: ignored'
