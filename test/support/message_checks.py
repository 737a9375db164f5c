"""Serialized messages as rosbags reads them, for the tests of the serializers."""

import math

import pytest

from diff_encoder_sim.drives.typestore import noetic_store


def read(raw, message_type):
    """The message as nested dicts, after a check that rosbags makes the same bytes of it."""
    message = noetic_store().deserialize_ros1(raw, message_type)
    assert bytes(noetic_store().serialize_ros1(message, message_type)) == raw
    return as_dict(message)


def as_dict(message, without=('__msgtype__', 'structure_needs_at_least_one_member')):
    """A message of either ROS as nested dicts; ROS 2 has no message without fields."""
    if isinstance(message, list):
        return [as_dict(each, without) for each in message]
    if not hasattr(message, '__dataclass_fields__'):
        return message.tolist() if hasattr(message, 'tolist') else message
    names = [name for name in message.__dataclass_fields__ if name.islower() and name not in without]
    return {name: as_dict(getattr(message, name), without) for name in names}


def time(stamp_ns):
    return {'sec': stamp_ns // 10**9, 'nanosec': stamp_ns % 10**9}


def header(stamp_ns, frame):
    return {'seq': 0, 'stamp': time(stamp_ns), 'frame_id': frame}


def planar(pose):
    half_yaw = math.sin(0.5 * pose.yaw_rad), math.cos(0.5 * pose.yaw_rad)
    quat = {'x': 0.0, 'y': 0.0, 'z': pytest.approx(half_yaw[0], abs=1e-6), 'w': pytest.approx(half_yaw[1], abs=1e-6)}
    return {'position': {'x': pose.x_m, 'y': pose.y_m, 'z': 0.0}, 'orientation': quat}
