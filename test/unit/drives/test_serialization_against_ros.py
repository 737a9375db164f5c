"""The lockstep's messages are byte for byte those of the nodes (skipped where there is no ROS)."""

import io

import numpy as np
import pytest

import message_values as values

pytest.importorskip('rospy')
pytest.importorskip('diff_encoder_sim.msg')

import rospy
from actionlib_msgs.msg import GoalID
from actionlib_msgs.msg import GoalStatus as ActionStatus
from geometry_msgs.msg import Point, Pose, Quaternion, Transform, TransformStamped, Twist, Vector3
from move_base_msgs.msg import MoveBaseActionGoal, MoveBaseActionResult, MoveBaseGoal, MoveBaseResult
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.drives.pose_messages import (
    ModelStatesEncoder,
    encode_pose_stamped,
    encode_pose_with_covariance,
    encode_spatial_transform,
    encode_tf,
    encode_transform,
)
from diff_encoder_sim.drives.sensor_messages import (
    SentGoal,
    encode_goal,
    encode_map,
    encode_map_metadata,
    encode_result,
)
from diff_encoder_sim.navigation.navigator_inputs import GoalStatus
from diff_encoder_sim.ros import conversions
from diff_encoder_sim.ros.gazebo_states import ModelStates
from diff_encoder_sim.ros.maps import map_message

NAME, STAMP_NS = '/navigation_trial_node', 5_610_000_000


@pytest.fixture(params=range(5))
def rng(request):
    return np.random.default_rng(request.param)


def serialised(message):
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def test_model_states(rng):
    world, body = values.world(rng), values.body(rng)
    expected = ModelStates(name=[*(model.name for model in world.models), 'alto'])
    for pose, twist in (
        *((conversions.matrix_pose_message(model.pose_in_world), Twist()) for model in world.models),
        (
            Pose(Point(*body.position_xyz_m), Quaternion(*body.quat_xyzw)),
            Twist(Vector3(*body.linear_xyz_mps), Vector3(*body.angular_xyz_radps)),
        ),
    ):
        expected.pose.append(pose)
        expected.twist.append(twist)
    assert ModelStatesEncoder(world, 'alto').encode(body) == serialised(expected)


def test_poses(rng):
    pose, covariance, now_ns = values.pose(rng), values.covariance(rng, 3), values.stamp_ns(rng)
    assert encode_pose_stamped(pose, now_ns, 'map') == serialised(conversions.pose_stamped_message(pose, now_ns, 'map'))
    assert encode_pose_with_covariance(pose, covariance, now_ns, 'map') == serialised(
        conversions.pose_with_covariance_message(pose, covariance, now_ns, 'map')
    )


def test_transforms(rng):
    pose, now_ns = values.pose(rng), values.stamp_ns(rng)
    translation, rotation = values.floats(rng, 3), values.quat_xyzw(rng)
    spatial = TransformStamped(
        child_frame_id='left_wheel', transform=Transform(Vector3(*translation), Quaternion(*rotation))
    )
    spatial.header.stamp = conversions.stamp_from_ns(now_ns)
    spatial.header.frame_id = 'base_link'
    expected = TFMessage([conversions.transform_message(pose, now_ns, 'map', 'odom'), spatial])
    assert encode_tf(
        encode_transform(pose, now_ns, 'map', 'odom'),
        encode_spatial_transform(translation, rotation, now_ns, 'base_link', 'left_wheel'),
    ) == serialised(expected)


def test_maps(rng):
    grid, now_ns = values.grid(rng), values.stamp_ns(rng)
    expected = map_message(grid, now_ns, 'map')
    assert encode_map(grid, now_ns, 'map') == serialised(expected)
    assert encode_map_metadata(grid, now_ns) == serialised(expected.info)


def goal_id():
    stamp = conversions.stamp_from_ns(STAMP_NS)
    return GoalID(stamp, f'{NAME}-2-{stamp.to_sec():.3f}')


def test_goals(rng):
    pose, now_ns = values.pose(rng), values.stamp_ns(rng)
    expected = MoveBaseActionGoal(
        goal_id=goal_id(), goal=MoveBaseGoal(conversions.pose_stamped_message(pose, now_ns, 'map'))
    )
    expected.header.stamp = rospy.Time(5, 610_000_000)
    assert encode_goal(SentGoal(NAME, 2, STAMP_NS), pose, now_ns, 'map') == serialised(expected)


@pytest.mark.parametrize(
    ('status', 'action_status'),
    [
        (GoalStatus.PREEMPTED, ActionStatus.PREEMPTED),
        (GoalStatus.SUCCEEDED, ActionStatus.SUCCEEDED),
        (GoalStatus.ABORTED, ActionStatus.ABORTED),
    ],
)
def test_results(status, action_status):
    expected = MoveBaseActionResult(status=ActionStatus(goal_id(), action_status, 'because'), result=MoveBaseResult())
    expected.header.stamp = rospy.Time(9)
    sent = SentGoal(NAME, 2, STAMP_NS)
    assert encode_result(sent, status, 'because', 9 * 10**9) == serialised(expected)
