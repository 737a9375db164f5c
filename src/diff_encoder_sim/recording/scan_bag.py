"""Reads what mapping needs from a bag: scans, odometry and the laser's mount."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Dict, Iterator, List, Tuple

from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.recording import topics
from diff_encoder_sim.serialization.message_types import LASER_SCAN, ODOMETRY, TRANSFORMS
from diff_encoder_sim.serialization.pose_messages import PoseDecoder, StampedPose
from diff_encoder_sim.serialization.scan_messages import decode_scan
from diff_encoder_sim.serialization.transform_messages import decode_tf


class ScanBag:
    """A drive with a laser. Scans are read as they are asked for."""

    def __init__(
        self, path: Path, reader: AnyReader, scan_topic: str = topics.SCAN, odom_topic: str = topics.ODOM
    ) -> None:
        """Read odometry and the laser's mount.

        Args:
            path: for messages.
            reader: from `open_bag`, for as long as this is used.
            scan_topic: of LaserScan.
            odom_topic: of Odometry.

        Raises:
            ConfigError: a topic is missing or of another type, a pose is not finite, or /tf_static
                does not contain where the laser is.
        """
        self._path, self._reader = path, reader
        self._scan_connections = self._connections(scan_topic, LASER_SCAN)
        odometry = self._read_odometry(self._connections(odom_topic, ODOMETRY))
        self.odometry_ns = [stamped.stamp_ns for stamped in odometry]
        self.base_poses_in_odom = [stamped.pose for stamped in odometry]
        self.laser_pose_in_base = self._laser_pose(odometry[-1].child_frame)

    def scans(self) -> Iterator[Scan]:
        """Yield the scans in the order they were recorded.

        Raises:
            ConfigError: a message is damaged.
        """
        for connection, raw in self._messages(self._scan_connections):
            with self._naming(connection.topic):
                scan, _ = decode_scan(raw, self._reader.is2)
            yield scan

    def _connections(self, topic: str, kind: str) -> List[Connection]:
        found = [connection for connection in self._reader.connections if connection.topic == topic]
        others = sorted({connection.msgtype for connection in found} - {kind})
        if others:
            raise ConfigError(f'{self._path}: {topic} is {", ".join(others)}; expected {kind}')
        if not sum(connection.msgcount for connection in found):
            raise ConfigError(f'{self._path}: no message on {topic}; expected {kind}')
        return found

    def _read_odometry(self, connections: List[Connection]) -> List[StampedPose]:
        decoder = PoseDecoder(ODOMETRY, self._reader.is2)
        poses = []
        for connection, raw in self._messages(connections):
            with self._naming(connection.topic):
                poses.append(decoder.decode(raw))
        return poses

    def _laser_pose(self, base_frame: str) -> Pose2D:
        """Return the laser's pose in the base frame by walking up the fixed transforms."""
        connection, raw = next(self._messages(self._scan_connections))
        with self._naming(connection.topic):
            laser_frame = decode_scan(raw, self._reader.is2)[1]
        fixed = self._fixed_frames()
        frame, pose = laser_frame, IDENTITY
        while frame != base_frame:
            if frame not in fixed:
                raise ConfigError(
                    f'{self._path}: {topics.TF_STATIC} does not lead from the '
                    f"scans' frame {laser_frame!r} to odometry's {base_frame!r}"
                )
            transform = fixed.pop(frame)  # popped, so that a circle ends
            frame, pose = transform.parent_frame, transform.pose.compose(pose)
        return pose

    def _fixed_frames(self) -> Dict[str, StampedPose]:
        """Return the newest transform of each fixed frame, by that child frame."""
        frames = {}
        static = [each for each in self._reader.connections if each.topic == topics.TF_STATIC]
        for connection, raw in self._messages([each for each in static if each.msgtype == TRANSFORMS]):
            with self._naming(connection.topic):
                frames.update({transform.child_frame: transform for transform in decode_tf(raw, self._reader.is2)})
        return frames

    def _messages(self, connections: List[Connection]) -> Iterator[Tuple[Connection, bytes]]:
        for connection, _, raw in self._reader.messages(connections) if connections else ():
            yield connection, raw

    @contextlib.contextmanager
    def _naming(self, topic: str) -> Iterator[None]:
        """Name the bag and the topic of a message that cannot be used."""
        try:
            yield
        except InputFault as error:
            raise ConfigError(f'{self._path}: {topic}: {error}') from None
