"""Reads what mapping needs from a bag: scans, odometry and the laser's mount."""

from __future__ import annotations

from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple, Optional

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.drives.drive_stream import DriveStream
from diff_encoder_sim.drives.message_decoders import PoseDecoder, StampedPose, decode_scan, decode_tf
from diff_encoder_sim.drives.topics import LASER_SCAN_TYPE, ODOM, ODOMETRY_TYPE, SCAN, TF_STATIC, TRANSFORMS_TYPE


class ScanDrive(NamedTuple):
    """A drive with a laser, without its scans."""

    odometry_ns: List[int]
    base_poses_in_odom: List[Pose2D]
    laser_pose_in_base: Pose2D


def read_scan_drive(path: Path, source: DriveStream, scan_topic: str = SCAN, odom_topic: str = ODOM) -> ScanDrive:
    """Read odometry and the laser's mount.

    Args:
        path: of the bag, for error messages.
        source: the bag.
        scan_topic: of LaserScan.
        odom_topic: of Odometry.

    Raises:
        ConfigError: a topic is missing or of another type, a pose is not finite, or /tf_static
            does not contain where the laser is.
    """
    decoder = PoseDecoder(ODOMETRY_TYPE, source.is_cdr)
    odometry: List[StampedPose] = []
    laser_frame: Optional[str] = None
    fixed: Dict[str, StampedPose] = {}  # the newest transform of each child frame
    expected = {scan_topic: LASER_SCAN_TYPE, odom_topic: ODOMETRY_TYPE}
    for topic, kind in expected.items():
        if source.topics.get(topic, kind) != kind:
            raise ConfigError(f'{path}: {topic} is {source.topics[topic]}; expected {kind}')
    static = [TF_STATIC] if source.topics.get(TF_STATIC) == TRANSFORMS_TYPE else []
    for message in source.messages((*expected, *static)):
        try:
            if message.topic == odom_topic:
                odometry.append(decoder.decode(message.raw))
            elif message.topic != scan_topic:
                fixed.update({each.child_frame: each for each in decode_tf(message.raw, source.is_cdr)})
            elif laser_frame is None:
                laser_frame = decode_scan(message.raw, source.is_cdr)[1]
        except InputFault as error:
            raise ConfigError(f'{path}: {message.topic}: {error}') from None
    if laser_frame is None or not odometry:
        topic = scan_topic if laser_frame is None else odom_topic
        torn = f' ({source.fault})' if source.fault else ''
        raise ConfigError(f'{path}: no message on {topic}{torn}; expected {expected[topic]}')
    frame, base_frame, laser_pose = laser_frame, odometry[-1].child_frame, IDENTITY
    while frame != base_frame:
        if frame not in fixed:
            from_to = f"the scans' frame {laser_frame!r} to odometry's {base_frame!r}"
            raise ConfigError(f'{path}: {TF_STATIC} does not lead from {from_to}')
        transform = fixed.pop(frame)  # popped, so that a circle ends
        frame, laser_pose = transform.parent_frame, transform.pose.compose(laser_pose)
    return ScanDrive([each.stamp_ns for each in odometry], [each.pose for each in odometry], laser_pose)


def read_scans(path: Path, source: DriveStream, scan_topic: str = SCAN) -> Iterator[Scan]:
    """Yield the scans in the order they were recorded, each read as it is asked for.

    Raises:
        ConfigError: a message is damaged.
    """
    for message in source.messages((scan_topic,)):
        try:
            yield decode_scan(message.raw, source.is_cdr)[0]
        except InputFault as error:
            raise ConfigError(f'{path}: {message.topic}: {error}') from None
