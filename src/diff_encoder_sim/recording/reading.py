"""Reads a trial's bag back into arrays."""
from __future__ import annotations

import json
from pathlib import Path
from typing import (Any, Container, Dict, Iterable, Iterator, List, NamedTuple, Optional, Tuple,
                    Union)

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection

from diff_encoder_sim.errors import ConfigError
from diff_encoder_sim.experiments.definition import Trial
from diff_encoder_sim.recording import topics
from diff_encoder_sim.recording.opening import open_bag
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
    with open_bag(path) as reader:
        return _trial_recording(path, reader)


def trial_of(path: Union[str, Path]) -> Optional[Trial]:
    """The trial that a bag is of; None when it says nothing of one.

    Raises:
        ConfigError: the file is no readable bag, or what it says is bad.
    """
    path = Path(path)
    with open_bag(path) as reader:
        return _trial(_texts(reader), path)


def _trial_recording(path: Path, reader: AnyReader) -> TrialRecording:
    texts = _texts(reader)
    trial = _trial(texts, path)
    if trial is None:
        raise ConfigError(f'{path}: no {topics.TRIAL} message; expected a bag that trial.launch '
                          f'recorded')
    result = _json(texts.get(topics.TRIAL_RESULT), topics.TRIAL_RESULT, path) or {}
    poses: Dict[str, List[Tuple[int, float, float, float]]] = {}
    for connection, message in _messages(reader, POSE_TOPICS, POSE_PATHS):
        poses.setdefault(connection.topic, []).append(_stamped_pose(message, connection, path))
    return TrialRecording(
        path, trial, str(result.get('outcome', 'torn')), str(result.get('reason', '')),
        {topic: _series(rows) for topic, rows in poses.items()})


def _messages(reader: AnyReader, names: Iterable[str], kinds: Container[str]
              ) -> Iterator[Tuple[Connection, Any]]:
    """Messages of some topics, if they are of a kind that is expected."""
    connections = [connection for connection in reader.connections
                   if connection.topic in names and connection.msgtype in kinds]
    for connection, _, raw in reader.messages(connections) if connections else ():
        yield connection, reader.deserialize(raw, connection.msgtype)


def _texts(reader: AnyReader) -> Dict[str, str]:
    """What the latched texts of a trial say, by topic."""
    return {connection.topic: message.data for connection, message in _messages(
        reader, (topics.TRIAL, topics.TRIAL_RESULT), ('std_msgs/msg/String',))}


def _trial(texts: Dict[str, str], path: Path) -> Optional[Trial]:
    about = _json(texts.get(topics.TRIAL), topics.TRIAL, path)
    return None if about is None else Trial.from_mapping(about, f'{path}: {topics.TRIAL}')


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
