"""Reads what mapping needs from a bag: scans, odometry and the laser's mount."""

from __future__ import annotations

from typing import Dict, Iterator, Optional, Tuple

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D, PoseSeries
from diff_encoder_sim.drives.drive_stream import DriveStream
from diff_encoder_sim.drives.message_decoders import StampedPose, decode_scan, decode_tf
from diff_encoder_sim.drives.recorded_poses import PoseTopic, frame_chain, pose_along
from diff_encoder_sim.drives.topics import LASER_SCAN_TYPE, ODOM, ODOMETRY_TYPE, SCAN, TF_STATIC, TRANSFORMS_TYPE


def read_scan_drive(source: DriveStream, scan_topic: str = SCAN, odom_topic: str = ODOM) -> Tuple[PoseSeries, Pose2D]:
    """Read the poses of odometry, and by /tf_static the laser's pose in the base; ConfigError if one is not there."""
    _check_type(source, odom_topic, ODOMETRY_TYPE)
    odometry = PoseTopic(odom_topic, ODOMETRY_TYPE, source.is_cdr)
    for message in source.messages((odom_topic,)):
        try:
            odometry.add(message)
        except InputFault as error:
            raise ConfigError(f'{source.path}: {message.topic}: {error}') from None
    if not odometry.stamps_ns:
        raise _no_message(source, odom_topic, ODOMETRY_TYPE)
    return odometry.series(), read_laser_pose(source, odometry.child_frame, scan_topic)


def read_laser_pose(source: DriveStream, base_frame: str, scan_topic: str = SCAN) -> Pose2D:
    """Read the pose of the scans' frame in the base by /tf_static; ConfigError if one of them is not there."""
    _check_type(source, scan_topic, LASER_SCAN_TYPE)
    laser_frame: Optional[str] = None
    fixed: Dict[str, StampedPose] = {}  # by child frame
    static = [TF_STATIC] if source.topics.get(TF_STATIC) == TRANSFORMS_TYPE else []
    for message in source.messages((scan_topic, *static)):
        try:
            if message.topic != scan_topic:
                fixed.update({each.child_frame: each for each in decode_tf(message.raw, source.is_cdr)})
            elif laser_frame is None:
                laser_frame = decode_scan(message.raw, source.is_cdr)[1]
        except InputFault as error:
            raise ConfigError(f'{source.path}: {message.topic}: {error}') from None
        chain = None if laser_frame is None else frame_chain(fixed, laser_frame, base_frame)
        if chain is not None:
            return pose_along(chain)
    if laser_frame is None:
        raise _no_message(source, scan_topic, LASER_SCAN_TYPE)
    from_to = f"the scans' frame {laser_frame!r} to the base frame {base_frame!r}"
    raise ConfigError(f'{source.path}: {TF_STATIC} does not lead from {from_to}')


def _check_type(source: DriveStream, topic: str, kind: str) -> None:
    if source.topics.get(topic, kind) != kind:
        raise ConfigError(f'{source.path}: {topic} is {source.topics[topic]}; expected {kind}')


def _no_message(source: DriveStream, topic: str, kind: str) -> ConfigError:
    torn = f' ({source.fault})' if source.fault else ''
    return ConfigError(f'{source.path}: no message on {topic}{torn}; expected {kind}')


def read_scans(source: DriveStream, scan_topic: str = SCAN) -> Iterator[Scan]:
    """Yield the scans in the order of their recording; ConfigError if a message is damaged."""
    for message in source.messages((scan_topic,)):
        try:
            yield decode_scan(message.raw, source.is_cdr)[0]
        except InputFault as error:
            raise ConfigError(f'{source.path}: {message.topic}: {error}') from None
