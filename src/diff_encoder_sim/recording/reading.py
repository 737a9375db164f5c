"""Reads a trial's bag back into arrays."""
from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional, Tuple, Union

import numpy as np
from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.rosbag1 import ReaderError

from diff_encoder_sim.errors import ConfigError
from diff_encoder_sim.experiments.definition import Trial
from diff_encoder_sim.recording import topics
from diff_encoder_sim.se2 import yaw_from_quat_xyzw
from diff_encoder_sim.timeline import NANOSECONDS_PER_SECOND

POSE_TOPICS = (topics.ODOM, topics.AMCL_POSE, topics.GLOBAL_POSE, topics.WORLD_POSE)
# Where each message type keeps its geometry_msgs/Pose.
POSE_PATHS = {
    'geometry_msgs/msg/PoseStamped': ('pose',),
    'geometry_msgs/msg/PoseWithCovarianceStamped': ('pose', 'pose'),
    'nav_msgs/msg/Odometry': ('pose', 'pose'),
}


class PoseSeries(NamedTuple):
    """Poses of one topic in the frame of its header, by their stamps."""

    stamps_ns: np.ndarray   # (n,) int64, as recorded
    x_y_yaw: np.ndarray     # (n, 3) [m, m, rad], yaw in [-pi, pi)


class TrialRecording(NamedTuple):
    """What a trial's bag tells."""

    path: Path
    trial: Trial
    outcome: str            # succeeded, failed, or torn when the bag has no result
    reason: str             # of a failure
    poses: Dict[str, PoseSeries]


def read_trial(path: Union[str, Path]) -> TrialRecording:
    """Read one bag of a trial.

    Raises:
        ConfigError: the file is no readable bag, or not one of a trial.
    """
    path = Path(path)
    if not path.is_file():
        raise ConfigError(f'{path}: no such bag')
    try:
        with AnyReader([path]) as reader:
            return _trial_recording(path, reader)
    except (AnyReaderError, ReaderError, EOFError) as error:
        raise ConfigError(f'{path}: not a readable bag: {error}') from None


def _trial_recording(path: Path, reader: AnyReader) -> TrialRecording:
    texts: Dict[str, str] = {}
    poses: Dict[str, List[Tuple[int, float, float, float]]] = {}
    wanted = (topics.TRIAL, topics.TRIAL_RESULT, *POSE_TOPICS)
    connections = [connection for connection in reader.connections if connection.topic in wanted]
    for connection, _, raw in reader.messages(connections) if connections else ():
        message = reader.deserialize(raw, connection.msgtype)
        if connection.msgtype in POSE_PATHS:
            poses.setdefault(connection.topic, []).append(
                _stamped_pose(message, connection, path))
        elif connection.msgtype == 'std_msgs/msg/String':
            texts[connection.topic] = message.data
    result = _json(texts.get(topics.TRIAL_RESULT), topics.TRIAL_RESULT, path) or {}
    trial = _json(texts.get(topics.TRIAL), topics.TRIAL, path)
    if trial is None:
        raise ConfigError(f'{path}: no {topics.TRIAL} message; expected a bag that trial.launch '
                          f'recorded')
    return TrialRecording(
        path, Trial.from_mapping(trial, f'{path}: {topics.TRIAL}'),
        str(result.get('outcome', 'torn')), str(result.get('reason', '')),
        {topic: _series(rows) for topic, rows in poses.items()})


def _stamped_pose(message: Any, connection: Any, path: Path) -> Tuple[int, float, float, float]:
    pose = message
    for name in POSE_PATHS[connection.msgtype]:
        pose = getattr(pose, name)
    stamp, quat = message.header.stamp, pose.orientation
    try:
        yaw_rad = yaw_from_quat_xyzw(quat.x, quat.y, quat.z, quat.w)
    except ValueError as error:
        raise ConfigError(f'{path}: {connection.topic}: {error}') from None
    return (stamp.sec * NANOSECONDS_PER_SECOND + stamp.nanosec,
            pose.position.x, pose.position.y, yaw_rad)


def _series(rows: List[Tuple[int, float, float, float]]) -> PoseSeries:
    return PoseSeries(np.array([row[0] for row in rows], dtype=np.int64),
                      np.array([row[1:] for row in rows], dtype=float))


def _json(text: Optional[str], topic: str, path: Path) -> Optional[Dict[str, Any]]:
    if text is None:
        return None
    try:
        content = json.loads(text)
    except json.JSONDecodeError as error:
        raise ConfigError(f'{path}: {topic}: not JSON: {error}') from None
    if not isinstance(content, dict):
        raise ConfigError(f'{path}: {topic}: given {text[:60]!r}; expected a JSON object')
    return content
