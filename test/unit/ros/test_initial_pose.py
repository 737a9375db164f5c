"""A pose that a user gives is checked, and moved by odometry from its stamp to now."""

import math

import numpy as np
import pytest

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')

import rospy
import tf2_ros

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.ros.amcl_node import InitialPoseReader
from diff_encoder_sim.ros.conversions import pose_with_covariance_message, transform_message

SECOND_NS = 1_000_000_000
COVARIANCE = np.diag([0.25, 0.25, 0.07])
GIVEN = Pose2D(2.0, 1.0, math.pi / 2)


@pytest.fixture(name='reader')
def fixture_reader():
    """The robot has driven 1 m ahead from 10 s to 11 s of odometry."""
    buffer = tf2_ros.Buffer(rospy.Duration(30.0), debug=False)
    for at_s in (10, 11):
        pose = Pose2D(at_s - 10.0, 0.0, 0.0)
        buffer.set_transform(transform_message(pose, at_s * SECOND_NS, 'odom', 'base_link'), 'test')
    return InitialPoseReader(AmclParams(), buffer)


def message(at_s, pose=GIVEN, frame='map'):
    return pose_with_covariance_message(pose, COVARIANCE, round(at_s * SECOND_NS), frame)


@pytest.mark.parametrize(
    ('at_s', 'expected'),
    [
        (0, GIVEN),  # now
        (10, Pose2D(2.0, 2.0, math.pi / 2)),
        (10.5, Pose2D(2.0, 1.5, math.pi / 2)),
        (11, GIVEN),
        (99, GIVEN),
    ],
)
def test_a_pose_of_some_time_ago_is_moved_by_odometry(reader, at_s, expected):
    pose, covariance = reader.read(message(at_s))
    assert pose == pytest.approx(expected) and covariance == pytest.approx(COVARIANCE)


def test_a_pose_from_before_all_odometry_is_used_as_it_is_with_a_warning(reader, caplog):
    assert reader.read(message(5))[0] == pytest.approx(GIVEN)
    assert 'not corrected for the motion since its stamp' in caplog.text


def test_a_pose_without_a_frame_is_in_the_map(reader, caplog):
    assert reader.read(message(0, frame=''))[0] == pytest.approx(GIVEN)
    assert "header.frame_id is empty; used as if it were 'map'" in caplog.text


@pytest.mark.parametrize(
    ('bad', 'complaint'),
    [
        (message(0, frame='odom'), "header.frame_id is 'odom'; expected 'map'"),
        (message(0, pose=Pose2D(math.nan, 0.0, 0.0)), r'position \(nan'),
    ],
)
def test_what_cannot_be_used_is_refused(reader, bad, complaint):
    with pytest.raises(InputFault, match=complaint):
        reader.read(bad)


def test_a_negative_variance_is_refused(reader):
    bad = message(0)
    bad.pose.covariance[0] = -1.0
    with pytest.raises(InputFault, match='no variance below 0'):
        reader.read(bad)
