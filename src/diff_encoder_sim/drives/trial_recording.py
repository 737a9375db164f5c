"""Reads a trial's bag back into arrays."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Dict, Iterator, List, Mapping, NamedTuple, Optional, Set, Tuple, Union

import numpy as np

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.se2 import PoseSeries
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.bag_source import BagSource, open_source
from diff_encoder_sim.drives.pose_messages import PoseDecoder, StampedPose
from diff_encoder_sim.drives.sensor_messages import decode_string
from diff_encoder_sim.drives.topics import (
    ODOMETRY_TYPE,
    POSE_STAMPED_TYPE,
    POSE_WITH_COVARIANCE_TYPE,
    STRING_TYPE,
    TRIAL,
    TRIAL_RESULT,
)
from diff_encoder_sim.drives.trial_definition import Outcome, Trial


def trial_of_source(path: Path, source: BagSource) -> Optional[Trial]:
    """Read the trial that a bag was recorded from; None where the bag has no /trial.

    Raises:
        ConfigError: /trial is not as expected.
    """
    for _, text in _texts(path, source, TRIAL):
        return _trial(path, text)
    return None


def _texts(path: Path, source: BagSource, *topics: str) -> Iterator[Tuple[str, str]]:
    strings = [topic for topic in topics if source.topics.get(topic) == STRING_TYPE]
    for message in source.messages(strings) if strings else ():
        try:
            yield message.topic, decode_string(message.raw, source.is_cdr)
        except InputFault as error:
            raise ConfigError(f'{path}: {message.topic}: {error}') from None


def _trial(path: Path, text: str) -> Trial:
    return Trial.from_mapping(_json(path, TRIAL, text), f'{path}: {TRIAL}')


def _json(path: Path, topic: str, text: str) -> Dict[str, Any]:
    try:
        content = json.loads(text)
    except json.JSONDecodeError as error:
        raise ConfigError(f'{path}: {topic}: not JSON: {error}') from None
    if not isinstance(content, dict):
        raise ConfigError(f'{path}: {topic}: given {text[:60]!r}; expected a JSON object')
    return content


# The topics whose poses are read, and the type that each must be of.
POSE_TOPICS = {
    topics.ODOM: ODOMETRY_TYPE,
    topics.AMCL_POSE: POSE_WITH_COVARIANCE_TYPE,
    topics.GLOBAL_POSE: POSE_STAMPED_TYPE,
    topics.WORLD_POSE: POSE_STAMPED_TYPE,
}
_TYPES = {topics.TRIAL: STRING_TYPE, topics.TRIAL_RESULT: STRING_TYPE, **POSE_TOPICS}


class TrialRecording(NamedTuple):
    """What a trial's bag contains, but for its bulk."""

    path: Path
    trial: Trial
    outcome: Outcome  # torn if the bag has no result
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
        for topic, expected in _TYPES.items():
            if source.topics.get(topic, expected) != expected:
                raise ConfigError(f'{path}: {topic} is {source.topics[topic]}; expected {expected}')
        texts = dict(_texts(path, source, TRIAL, TRIAL_RESULT))
        if TRIAL not in texts:
            raise ConfigError(f'{path}: no {TRIAL} message; expected a bag that trial.launch or a campaign recorded')
        trial = _trial(path, texts[TRIAL])
        result = _json(path, TRIAL_RESULT, texts.get(TRIAL_RESULT, '{}'))
        outcome, allowed = result.get('outcome', Outcome.TORN.value), [each.value for each in Outcome]
        if outcome not in allowed:
            raise ConfigError(f'{path}: {TRIAL_RESULT}: outcome: given {outcome!r}; allowed: {", ".join(allowed)}')
        poses = _read_poses(path, source)
        _check_whole(path, source)
        return TrialRecording(path, trial, Outcome(outcome), str(result.get('reason', '')), poses)


def _check_whole(path: Path, source: BagSource) -> None:
    if source.fault:
        raise ConfigError(f'{path}: not a whole bag: {source.fault}; expected it as it was recorded')


def _read_poses(path: Path, source: BagSource) -> Dict[str, PoseSeries]:
    decoders = {topic: PoseDecoder(kind, source.is_cdr) for topic, kind in POSE_TOPICS.items()}
    poses: Dict[str, List[StampedPose]] = {}
    nodes: Dict[str, Set[str]] = {}
    other_odometry = {topic for topic, kind in source.topics.items() if kind == ODOMETRY_TYPE and topic != topics.ODOM}
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
    return {
        topic: PoseSeries(np.array([each.stamp_ns for each in of_topic]), np.array([each.pose for each in of_topic]))
        for topic, of_topic in poses.items()
    }


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
