"""Reads what mapping needs from a bag: scans, odometry and the laser's mount."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Dict, Iterator, List, Optional, Tuple

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.bag_source import BagSource, Message
from diff_encoder_sim.drives.pose_messages import PoseDecoder, StampedPose, decode_tf
from diff_encoder_sim.drives.sensor_messages import decode_scan
from diff_encoder_sim.drives.topics import LASER_SCAN_TYPE, ODOMETRY_TYPE, TRANSFORMS_TYPE


class ScanBag:
    """A drive with a laser. Scans are read as they are asked for."""

    def __init__(
        self, path: Path, source: BagSource, scan_topic: str = topics.SCAN, odom_topic: str = topics.ODOM
    ) -> None:
        """Read odometry and the laser's mount.

        Args:
            path: for messages.
            source: from `open_source`, for as long as this is used.
            scan_topic: of LaserScan.
            odom_topic: of Odometry.

        Raises:
            ConfigError: a topic is missing or of another type, a pose is not finite, or /tf_static
                does not contain where the laser is.
        """
        self._path, self._source = path, source
        self._scan_topic = scan_topic
        self._check_type(scan_topic, LASER_SCAN_TYPE)
        self._check_type(odom_topic, ODOMETRY_TYPE)
        odometry, laser_frame, fixed = self._read_drive(odom_topic)
        self.odometry_ns = [stamped.stamp_ns for stamped in odometry]
        self.base_poses_in_odom = [stamped.pose for stamped in odometry]
        self.laser_pose_in_base = self._laser_pose(laser_frame, odometry[-1].child_frame, fixed)

    def scans(self) -> Iterator[Scan]:
        """Yield the scans in the order they were recorded.

        Raises:
            ConfigError: a message is damaged.
        """
        for message in self._source.messages((self._scan_topic,)):
            yield self._decode_scan(message)[0]

    def _check_type(self, topic: str, kind: str) -> None:
        found = self._source.topics.get(topic)
        if found is None:
            raise self._missing(topic, kind)
        if found != kind:
            raise ConfigError(f'{self._path}: {topic} is {found}; expected {kind}')

    def _missing(self, topic: str, kind: str) -> ConfigError:
        torn = f' ({self._source.fault})' if self._source.fault else ''
        return ConfigError(f'{self._path}: no message on {topic}{torn}; expected {kind}')

    def _read_drive(self, odom_topic: str) -> Tuple[List[StampedPose], str, Dict[str, StampedPose]]:
        """Return odometry, the frame of the scans, and the newest transform of each fixed frame by that child frame."""
        decoder = PoseDecoder(ODOMETRY_TYPE, self._source.is_cdr)
        poses: List[StampedPose] = []
        laser_frame: Optional[str] = None
        fixed: Dict[str, StampedPose] = {}
        static = [topics.TF_STATIC] if self._source.topics.get(topics.TF_STATIC) == TRANSFORMS_TYPE else []
        for message in self._source.messages((self._scan_topic, odom_topic, *static)):
            with self._naming(message.topic):
                if message.topic == odom_topic:
                    poses.append(decoder.decode(message.raw))
                elif message.topic != self._scan_topic:
                    fixed.update({each.child_frame: each for each in decode_tf(message.raw, self._source.is_cdr)})
                elif laser_frame is None:
                    laser_frame = self._decode_scan(message)[1]
        if laser_frame is None:
            raise self._missing(self._scan_topic, LASER_SCAN_TYPE)
        if not poses:
            raise self._missing(odom_topic, ODOMETRY_TYPE)
        return poses, laser_frame, fixed

    def _decode_scan(self, message: Message) -> Tuple[Scan, str]:
        with self._naming(message.topic):
            return decode_scan(message.raw, self._source.is_cdr)

    def _laser_pose(self, laser_frame: str, base_frame: str, fixed: Dict[str, StampedPose]) -> Pose2D:
        """Return the laser's pose in the base frame by walking up the fixed transforms."""
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

    @contextlib.contextmanager
    def _naming(self, topic: str) -> Iterator[None]:
        """Name the bag and the topic of a message that cannot be used."""
        try:
            yield
        except InputFault as error:
            raise ConfigError(f'{self._path}: {topic}: {error}') from None
