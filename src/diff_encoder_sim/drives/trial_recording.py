"""Reads a trial's bag back into arrays."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Dict, NamedTuple, Optional, Set, Union

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.se2 import PoseSeries
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.bag_source import open_source
from diff_encoder_sim.drives.drive_stream import DriveStream
from diff_encoder_sim.drives.message_decoders import decode_string
from diff_encoder_sim.drives.recorded_poses import PoseTopic
from diff_encoder_sim.drives.topics import ODOMETRY_TYPE, STRING_TYPE, TRIAL, TRIAL_RESULT
from diff_encoder_sim.drives.trial_definition import Outcome, Trial

_TYPES = {topic.name: topic.message_type for topic in topics.TOPICS}
POSE_TOPICS = {topic: _TYPES[topic] for topic in (*topics.TOPIC_OF_SOURCE.values(), topics.FILTERED)}  # types by topic


class TrialRecording(NamedTuple):
    """The contents of a trial's bag, except its bulk."""

    path: Path
    trial: Trial
    outcome: Outcome  # torn if the bag has no result
    reason: str  # of a failure
    poses: Dict[str, PoseSeries]  # by topic; those without a message are left out


def trial_of_source(source: DriveStream) -> Optional[Trial]:
    """Read the trial that a bag was recorded from, None without /trial; ConfigError if it is not as expected."""
    about = _json(source, TRIAL)
    return None if about is None else Trial.from_mapping(about, f'{source.path}: {TRIAL}')


def _json(source: DriveStream, topic: str) -> Optional[Dict[str, Any]]:
    """Return the first text of a topic; None if there is none."""
    message = next(source.messages([topic]), None) if source.topics.get(topic) == STRING_TYPE else None
    if message is None:
        return None
    try:
        content = json.loads(decode_string(message.raw, source.is_cdr))
    except (InputFault, json.JSONDecodeError) as error:
        raise ConfigError(f'{source.path}: {topic}: not JSON: {error}') from None
    if not isinstance(content, dict):
        raise ConfigError(f'{source.path}: {topic}: given {str(content)[:60]!r}; expected a JSON object')
    return content


def read_trial(path: Union[str, Path]) -> TrialRecording:
    """Read one bag of a trial; ConfigError if it is not whole, of a trial and of one robot, with finite poses."""
    source = open_source(Path(path))
    _check_whole(source)
    for topic in (TRIAL, TRIAL_RESULT, *POSE_TOPICS):
        if source.topics.get(topic, _TYPES[topic]) != _TYPES[topic]:
            raise ConfigError(f'{source.path}: {topic} is {source.topics[topic]}; expected {_TYPES[topic]}')
    trial = trial_of_source(source)
    if trial is None:
        raise ConfigError(f'{source.path}: no {TRIAL} message; expected a bag that trial.launch or a campaign recorded')
    result = _json(source, TRIAL_RESULT) or {}
    outcome, allowed = result.get('outcome', Outcome.TORN.value), [each.value for each in Outcome]
    if outcome not in allowed:
        raise ConfigError(f'{source.path}: {TRIAL_RESULT}: outcome: given {outcome!r}; allowed: {", ".join(allowed)}')
    poses = _read_poses(source)
    _check_whole(source)
    return TrialRecording(source.path, trial, Outcome(outcome), str(result.get('reason', '')), poses)


def _check_whole(source: DriveStream) -> None:
    if source.fault:
        raise ConfigError(f'{source.path}: not a whole bag: {source.fault}; expected it as it was recorded')


def _read_poses(source: DriveStream) -> Dict[str, PoseSeries]:
    """Read the poses by topic; a bag of several robots, which would be taken for one robot that jumps, is refused."""
    poses = {topic: PoseTopic(topic, kind, source.is_cdr) for topic, kind in POSE_TOPICS.items()}
    nodes: Dict[str, Set[str]] = {}
    odometry = sorted({topic for topic, kind in source.topics.items() if kind == ODOMETRY_TYPE} - {topics.FILTERED})
    if odometry[1:]:
        raise ConfigError(f'{source.path}: odometry on {" and ".join(odometry)}; expected one robot, on {topics.ODOM}')
    for message in source.messages(POSE_TOPICS):
        nodes.setdefault(message.topic, set()).add(message.node)
        of_topic = poses[message.topic]
        try:
            of_topic.add(message)
        except InputFault as error:
            fault = f'message {len(of_topic.stamps_ns) + 1}: {error}; expected a finite pose'
            raise ConfigError(f'{source.path}: {message.topic}: {fault}') from None
    for topic, of_nodes in nodes.items():
        if len(of_nodes) > 1:
            published = f'{topic} is published by {" and ".join(sorted(of_nodes))}'
            raise ConfigError(f'{source.path}: {published}; expected one robot, and one node on each topic')
    return {topic: of_topic.series() for topic, of_topic in poses.items() if of_topic.stamps_ns}
