"""Scans, odometry and the laser's mount out of a bag: what mapping needs."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Dict, Iterator, List, Tuple

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, yaw_from_quat_xyzw
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.recording import topics
from diff_encoder_sim.serialization.message_types import LASER_SCAN, ODOMETRY, TRANSFORMS


class ScanBag:
    """A drive with a laser. Scans are read as they are asked for."""

    def __init__(
        self, path: Path, reader: AnyReader, scan_topic: str = topics.SCAN, odom_topic: str = topics.ODOM
    ) -> None:
        """Args:
            path: for messages.
            reader: from `open_bag`, for as long as this is used.

        Raises:
            ConfigError: a topic is missing or of another type, a pose is not finite, or nothing
                tells where the laser is.
        """
        self._path, self._reader = path, reader
        self._scan_connections = self._connections(scan_topic, LASER_SCAN)
        odometry = self._connections(odom_topic, ODOMETRY)
        self.odometry_ns, self.base_poses_in_odom, base_frame = self._read_odometry(odometry)
        self.laser_pose_in_base = self._laser_pose(base_frame)

    def scans(self) -> Iterator[Scan]:
        """In the order they were recorded."""
        for connection, _, raw in self._reader.messages(self._scan_connections):
            message = self._reader.deserialize(raw, connection.msgtype)
            yield Scan(
                _stamp_ns(message),
                float(message.angle_min),
                float(message.angle_increment),
                float(message.range_min),
                float(message.range_max),
                np.asarray(message.ranges, dtype=float),
            )

    def _connections(self, topic: str, kind: str) -> List[Connection]:
        found = [connection for connection in self._reader.connections if connection.topic == topic]
        others = sorted({connection.msgtype for connection in found} - {kind})
        if others:
            raise ConfigError(f'{self._path}: {topic} is {", ".join(others)}; expected {kind}')
        if not sum(connection.msgcount for connection in found):
            raise ConfigError(f'{self._path}: no message on {topic}; expected {kind}')
        return found

    def _read_odometry(self, connections: List[Connection]) -> Tuple[List[int], List[Pose2D], str]:
        """Stamps, base poses, and the base's frame."""
        stamps_ns, poses, base_frame = [], [], ''
        for connection, _, raw in self._reader.messages(connections):
            message = self._reader.deserialize(raw, connection.msgtype)
            stamps_ns.append(_stamp_ns(message))
            poses.append(self._planar(message.pose.pose.position, message.pose.pose.orientation, connection.topic))
            base_frame = message.child_frame_id.lstrip('/')
        return stamps_ns, poses, base_frame

    def _laser_pose(self, base_frame: str) -> Pose2D:
        """Of the laser in the base, up the chain of fixed frames."""
        connection, _, raw = next(self._reader.messages(self._scan_connections))
        laser_frame = self._reader.deserialize(raw, connection.msgtype).header.frame_id.lstrip('/')
        fixed = self._fixed_frames()
        frame, pose = laser_frame, IDENTITY
        while frame != base_frame:
            if frame not in fixed:
                raise ConfigError(
                    f'{self._path}: {topics.TF_STATIC} does not lead from the '
                    f"scans' frame {laser_frame!r} to odometry's {base_frame!r}"
                )
            frame, pose_in_parent = fixed.pop(frame)  # popped, so that a circle ends
            pose = pose_in_parent.compose(pose)
        return pose

    def _fixed_frames(self) -> Dict[str, Tuple[str, Pose2D]]:
        """Of each fixed frame: its parent, and its pose in that."""
        frames: Dict[str, Tuple[str, Pose2D]] = {}
        connections = [
            connection
            for connection in self._reader.connections
            if connection.topic == topics.TF_STATIC and connection.msgtype == TRANSFORMS
        ]
        for connection, _, raw in self._reader.messages(connections) if connections else ():
            for stamped in self._reader.deserialize(raw, connection.msgtype).transforms:
                frames[stamped.child_frame_id.lstrip('/')] = (
                    stamped.header.frame_id.lstrip('/'),
                    self._planar(stamped.transform.translation, stamped.transform.rotation, connection.topic),
                )
        return frames

    def _planar(self, position: Any, rotation: Any, topic: str) -> Pose2D:
        try:
            yaw_rad = yaw_from_quat_xyzw(rotation.x, rotation.y, rotation.z, rotation.w)
        except ValueError as error:
            raise ConfigError(f'{self._path}: {topic}: {error}') from None
        x_m, y_m = float(position.x), float(position.y)
        if not (math.isfinite(x_m) and math.isfinite(y_m)):
            raise ConfigError(f'{self._path}: {topic}: no position: ({x_m}, {y_m}); expected finite numbers')
        return Pose2D(x_m, y_m, yaw_rad)


def _stamp_ns(message: Any) -> int:
    stamp = message.header.stamp
    return int(stamp.sec) * NANOSECONDS_PER_SECOND + int(stamp.nanosec)
