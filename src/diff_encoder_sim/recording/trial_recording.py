"""Reads a trial's bag back into arrays."""

from __future__ import annotations

import contextlib
import json
import math
import struct
from pathlib import Path
from typing import Any, Dict, Iterator, List, NamedTuple, Optional, Tuple, Union

import numpy as np
from rosbags.highlevel import AnyReader
from rosbags.interfaces import Connection

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import yaw_from_quat_xyzw
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.recording import topics
from diff_encoder_sim.recording.bag_opening import naming_damage, open_bag
from diff_encoder_sim.serialization.message_types import ODOMETRY, POSE_STAMPED, POSE_WITH_COVARIANCE, STRING
from diff_encoder_sim.serialization.typestore import definition
from diff_encoder_sim.trials.trial_definition import Trial
from diff_encoder_sim.trials.trial_outcome import Outcome

# What is read, and of which type it must be.
TEXT_TOPICS = {topics.TRIAL: STRING, topics.TRIAL_RESULT: STRING}
POSE_TOPICS = {
    topics.ODOM: ODOMETRY,
    topics.AMCL_POSE: POSE_WITH_COVARIANCE,
    topics.GLOBAL_POSE: POSE_STAMPED,
    topics.WORLD_POSE: POSE_STAMPED,
}

# On the wire (little endian) a stamped pose begins with seq, stamp and frame_id; a second text,
# child_frame_id, stands before the geometry_msgs/Pose of an Odometry. Taken apart here because
# rosbags' deserialiser takes ten times as long, and a campaign has millions of them.
_STAMP, _STAMP_OFFSET = struct.Struct('<2I'), 4
_LENGTH, _TEXT_OFFSET = struct.Struct('<I'), 12
_POSE = struct.Struct('<7d')

StampedPose = Tuple[int, float, float, float]  # [ns], [m], [m], [rad]


class PoseSeries(NamedTuple):
    """Poses of one topic in the frame of its header, by their stamps; at least one."""

    stamps_ns: np.ndarray  # (n,) int64, as recorded
    x_y_yaw: np.ndarray  # (n, 3) [m, m, rad], finite, yaw in [-pi, pi)


class TrialRecording(NamedTuple):
    """What a trial's bag tells."""

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
    with _opened(path) as reader:
        return _trial_recording(path, reader)


def trial_of(path: Union[str, Path]) -> Optional[Trial]:
    """The trial that a bag is of; None when it says nothing of one.

    Raises:
        ConfigError: the file is no readable bag, or what it says is bad.
    """
    path = Path(path)
    with _opened(path) as reader:
        return _trial(_texts(reader, path), path)


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[AnyReader]:
    with open_bag(path) as reader:
        if reader.is2:
            raise ConfigError(f"{path}: a ROS 2 bag; expected a trial's, of ROS 1")
        yield reader


def _trial_recording(path: Path, reader: AnyReader) -> TrialRecording:
    texts = _texts(reader, path)
    trial = _trial(texts, path)
    if trial is None:
        raise ConfigError(f'{path}: no {topics.TRIAL} message; expected a bag that trial.launch or a campaign recorded')
    result = _json(texts.get(topics.TRIAL_RESULT), topics.TRIAL_RESULT, path) or {}
    return TrialRecording(path, trial, _outcome(result, path), str(result.get('reason', '')), _poses(reader, path))


def _outcome(result: Dict[str, Any], path: Path) -> Outcome:
    given = result.get('outcome', Outcome.TORN.value)
    try:
        return Outcome(given)
    except ValueError:
        allowed = ', '.join(outcome.value for outcome in Outcome)
        raise ConfigError(f'{path}: {topics.TRIAL_RESULT}: outcome: given {given!r}; allowed: {allowed}') from None


def _texts(reader: AnyReader, path: Path) -> Dict[str, str]:
    """What the latched texts of a trial say, by topic."""
    texts = {}
    for connection, raw in _messages(reader, TEXT_TOPICS, path):
        with naming_damage(path):
            texts[connection.topic] = reader.deserialize(raw, connection.msgtype).data
    return texts


def _poses(reader: AnyReader, path: Path) -> Dict[str, PoseSeries]:
    _check_one_robot(reader, path)
    rows: Dict[str, List[StampedPose]] = {}
    for connection, raw in _messages(reader, POSE_TOPICS, path):
        topic = connection.topic
        try:
            rows.setdefault(topic, []).append(stamped_pose(raw, connection.msgtype))
        except (ValueError, struct.error) as error:
            raise ConfigError(
                f'{path}: {topic}: message {len(rows[topic]) + 1}: {error}; expected a finite pose'
            ) from None
    return {
        topic: PoseSeries(
            np.array([row[0] for row in of_topic], dtype=np.int64), np.array([row[1:] for row in of_topic])
        )
        for topic, of_topic in rows.items()
    }


def stamped_pose(raw: bytes, message_type: str) -> StampedPose:
    """Stamp, x, y and yaw of a serialised message of one of POSE_TOPICS' types.

    Raises:
        ValueError: a number is not finite, or the quaternion is zero.
        struct.error: the message is too short.
    """
    offset = _TEXT_OFFSET
    for _ in range(2 if message_type == ODOMETRY else 1):
        offset += _LENGTH.size + _LENGTH.unpack_from(raw, offset)[0]
    x_m, y_m, z_m, *quat_xyzw = _POSE.unpack_from(raw, offset)
    if not math.isfinite(x_m + y_m + z_m):
        raise ValueError(f'no position: ({x_m}, {y_m}, {z_m})')
    seconds, nanoseconds = _STAMP.unpack_from(raw, _STAMP_OFFSET)
    return (seconds * NANOSECONDS_PER_SECOND + nanoseconds, x_m, y_m, yaw_from_quat_xyzw(*quat_xyzw))


def _check_one_robot(reader: AnyReader, path: Path) -> None:
    """What several robots publish would be taken for one robot that jumps."""
    spoken = [connection for connection in reader.connections if connection.msgcount]
    odometry = sorted({connection.topic for connection in spoken if connection.msgtype == ODOMETRY})
    if len(odometry) > 1:
        raise ConfigError(f'{path}: odometry on {" and ".join(odometry)}; expected one robot, on {topics.ODOM}')
    for topic in POSE_TOPICS:
        nodes = sorted({str(connection.ext.callerid) for connection in spoken if connection.topic == topic})
        if len(nodes) > 1:
            raise ConfigError(
                f'{path}: {topic} is published by {" and ".join(nodes)}; expected one robot, and one node on each topic'
            )


def _messages(reader: AnyReader, kinds: Dict[str, str], path: Path) -> Iterator[Tuple[Connection, bytes]]:
    """Messages of some topics as they are on the wire.

    Raises:
        ConfigError: a topic is of another type than `kinds` says.
    """
    connections = [connection for connection in reader.connections if connection.topic in kinds]
    for connection in connections:
        kind = kinds[connection.topic]
        if connection.msgtype != kind or connection.digest != definition(kind).md5sum:
            raise ConfigError(
                f'{path}: {connection.topic} is {connection.msgtype} '
                f'({connection.digest}); expected {kind} '
                f'({definition(kind).md5sum})'
            )
    with naming_damage(path):
        for connection, _, raw in reader.messages(connections) if connections else ():
            yield connection, raw


def _trial(texts: Dict[str, str], path: Path) -> Optional[Trial]:
    about = _json(texts.get(topics.TRIAL), topics.TRIAL, path)
    return None if about is None else Trial.from_mapping(about, f'{path}: {topics.TRIAL}')


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
