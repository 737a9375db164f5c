"""Reads a trial's bag back into arrays."""

from __future__ import annotations

from pathlib import Path
from typing import Dict, List, NamedTuple, Union

import numpy as np
from rosbags.interfaces import Connection
from rosbags.rosbag1 import Reader

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.pose_series import PoseSeries
from diff_encoder_sim.recording import topics
from diff_encoder_sim.recording.bag_opening import open_ros1_bag, typed_messages
from diff_encoder_sim.recording.trial_metadata import read_metadata
from diff_encoder_sim.serialization.message_types import ODOMETRY, POSE_STAMPED, POSE_WITH_COVARIANCE
from diff_encoder_sim.serialization.pose_messages import PoseDecoder, StampedPose
from diff_encoder_sim.trials.trial_definition import Trial
from diff_encoder_sim.trials.trial_outcome import Outcome

# The topics whose poses are read, and the type that each must be of.
POSE_TOPICS = {
    topics.ODOM: ODOMETRY,
    topics.AMCL_POSE: POSE_WITH_COVARIANCE,
    topics.GLOBAL_POSE: POSE_STAMPED,
    topics.WORLD_POSE: POSE_STAMPED,
}


class TrialRecording(NamedTuple):
    """What a trial's bag contains, but for its bulk."""

    path: Path
    trial: Trial
    outcome: Outcome
    reason: str  # of a failure
    poses: Dict[str, PoseSeries]  # by topic; those without a message are left out


def read_trial(path: Union[str, Path]) -> TrialRecording:
    """Read one bag of a trial.

    Raises:
        ConfigError: the file is no readable bag, not one of a trial, of several robots, or a pose
            in it is not finite.
    """
    path = Path(path)
    with open_ros1_bag(path) as reader:
        metadata = read_metadata(path, reader)
        if metadata is None:
            missing = f'no {topics.TRIAL} message; expected a bag that trial.launch or a campaign recorded'
            raise ConfigError(f'{path}: {missing}')
        return TrialRecording(path, *metadata, _read_poses(path, reader))


def _read_poses(path: Path, reader: Reader) -> Dict[str, PoseSeries]:
    _check_one_robot(path, reader)
    decoders = {topic: PoseDecoder(kind) for topic, kind in POSE_TOPICS.items()}
    poses: Dict[str, List[StampedPose]] = {}
    for connection, raw in typed_messages(path, reader, POSE_TOPICS):
        topic = connection.topic
        of_topic = poses.setdefault(topic, [])
        try:
            of_topic.append(decoders[topic].decode(raw))
        except InputFault as error:
            fault = f'message {len(of_topic) + 1}: {error}; expected a finite pose'
            raise ConfigError(f'{path}: {topic}: {fault}') from None
    return {topic: _series(of_topic) for topic, of_topic in poses.items()}


def _series(poses: List[StampedPose]) -> PoseSeries:
    return PoseSeries(
        np.array([stamped.stamp_ns for stamped in poses], dtype=np.int64), np.array([stamped.pose for stamped in poses])
    )


def _node(connection: Connection) -> str:
    return str(getattr(connection.ext, 'callerid', None))


def _check_one_robot(path: Path, reader: Reader) -> None:
    """Refuse a bag of several robots, which would be taken for one robot that jumps."""
    used = [connection for connection in reader.connections if connection.msgcount]
    odometry = sorted({connection.topic for connection in used if connection.msgtype == ODOMETRY})
    if len(odometry) > 1:
        raise ConfigError(f'{path}: odometry on {" and ".join(odometry)}; expected one robot, on {topics.ODOM}')
    for topic in POSE_TOPICS:
        nodes = sorted({_node(connection) for connection in used if connection.topic == topic})
        if len(nodes) > 1:
            raise ConfigError(
                f'{path}: {topic} is published by {" and ".join(nodes)}; expected one robot, and one node on each topic'
            )
