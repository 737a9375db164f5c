"""Reads a trial's bag back into arrays."""

from __future__ import annotations

from pathlib import Path
from typing import Dict, List, Mapping, NamedTuple, Set, Union

import numpy as np

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.pose_series import PoseSeries
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.bag_source import BagSource, open_source
from diff_encoder_sim.drives.message_types import ODOMETRY, POSE_STAMPED, POSE_WITH_COVARIANCE, STRING
from diff_encoder_sim.drives.pose_messages import PoseDecoder, StampedPose
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.drives.trial_metadata import read_metadata
from diff_encoder_sim.drives.trial_outcome import Outcome
from diff_encoder_sim.drives.typestore import definition

# The topics whose poses are read, and the type that each must be of.
POSE_TOPICS = {
    topics.ODOM: ODOMETRY,
    topics.AMCL_POSE: POSE_WITH_COVARIANCE,
    topics.GLOBAL_POSE: POSE_STAMPED,
    topics.WORLD_POSE: POSE_STAMPED,
}
_TYPES = {topics.TRIAL: STRING, topics.TRIAL_RESULT: STRING, **POSE_TOPICS}


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
        ConfigError: the bag cannot be read to its end, is not one of a trial, is of several robots,
            or a pose in it is not finite.
    """
    path = Path(path)
    with open_source(path) as source:
        _check_whole(path, source)
        _check_types(path, source)
        metadata = read_metadata(path, source)
        if metadata is None:
            missing = f'no {topics.TRIAL} message; expected a bag that trial.launch or a campaign recorded'
            raise ConfigError(f'{path}: {missing}')
        recording = TrialRecording(path, *metadata, _read_poses(path, source))
        _check_whole(path, source)
        return recording


def _check_whole(path: Path, source: BagSource) -> None:
    if source.fault:
        raise ConfigError(f'{path}: not a whole bag: {source.fault}; expected it as it was recorded')


def _check_types(path: Path, source: BagSource) -> None:
    for connection in source.connections:
        kind = _TYPES.get(connection.topic, connection.message_type)
        given, expected = [connection.message_type], [kind]
        if connection.topic in _TYPES and not source.is_cdr:
            given.append(f'({connection.md5sum})')
            expected.append(f'({definition(kind).md5sum})')
        if given != expected:
            raise ConfigError(f'{path}: {connection.topic} is {" ".join(given)}; expected {" ".join(expected)}')


def _read_poses(path: Path, source: BagSource) -> Dict[str, PoseSeries]:
    decoders = {topic: PoseDecoder(kind, source.is_cdr) for topic, kind in POSE_TOPICS.items()}
    poses: Dict[str, List[StampedPose]] = {}
    nodes: Dict[str, Set[str]] = {}
    other_odometry = {topic for topic, kind in source.topics.items() if kind == ODOMETRY and topic != topics.ODOM}
    for message in source.messages({*POSE_TOPICS, *other_odometry}):
        topic = message.topic
        nodes.setdefault(topic, set()).add(message.node)
        if topic in other_odometry:
            continue
        of_topic = poses.setdefault(topic, [])
        try:
            of_topic.append(decoders[topic].decode(message.raw))
        except InputFault as error:
            fault = f'message {len(of_topic) + 1}: {error}; expected a finite pose'
            raise ConfigError(f'{path}: {topic}: {fault}') from None
    _check_one_robot(path, nodes, other_odometry)
    return {topic: _series(of_topic) for topic, of_topic in poses.items()}


def _series(poses: List[StampedPose]) -> PoseSeries:
    return PoseSeries(
        np.array([stamped.stamp_ns for stamped in poses], dtype=np.int64), np.array([stamped.pose for stamped in poses])
    )


def _check_one_robot(path: Path, nodes: Mapping[str, Set[str]], other_odometry: Set[str]) -> None:
    """Refuse a bag of several robots, which would be taken for one robot that jumps."""
    odometry = sorted(set(nodes) & {topics.ODOM, *other_odometry})
    if len(odometry) > 1:
        raise ConfigError(f'{path}: odometry on {" and ".join(odometry)}; expected one robot, on {topics.ODOM}')
    for topic in POSE_TOPICS:
        if len(nodes.get(topic, ())) > 1:
            raise ConfigError(
                f'{path}: {topic} is published by {" and ".join(sorted(nodes[topic]))}; '
                'expected one robot, and one node on each topic'
            )
