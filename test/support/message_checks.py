"""What rosbags reads in serialized messages, for the tests of the serializers."""

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import yaw_from_quat_xyzw
from diff_encoder_sim.drives.typestore import noetic_store


def read(raw, message_type):
    """The message, after a look whether rosbags makes the same bytes of it."""
    message = noetic_store().deserialize_ros1(raw, message_type)
    assert bytes(noetic_store().serialize_ros1(message, message_type)) == raw
    return message


def stamp_ns(stamp):
    return stamp.sec * 10**9 + stamp.nanosec


def vector(part):
    return part.x, part.y, part.z


def quat(part):
    return part.x, part.y, part.z, part.w


def check_header(header, stamp, frame):
    assert (header.seq, stamp_ns(header.stamp), header.frame_id) == (0, stamp, frame)


def check_pose(message, pose):
    assert vector(message.position) == (pose.x_m, pose.y_m, 0.0)
    turned = yaw_from_quat_xyzw(*quat(message.orientation)) - pose.yaw_rad
    assert np.exp(1j * turned) == pytest.approx(1.0, abs=1e-6)
    assert (message.orientation.x, message.orientation.y) == (0.0, 0.0)
