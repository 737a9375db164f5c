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
from genpy.dynamic import generate_dynamic
from geometry_msgs.msg import PoseArray, Quaternion, Transform, TransformStamped, Twist, Vector3
from move_base_msgs.msg import MoveBaseActionGoal, MoveBaseActionResult, MoveBaseGoal, MoveBaseResult
from rosgraph_msgs.msg import Clock
from roslib.message import get_message_class
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

import field_messages as fields
from diff_encoder_sim.drives.pose_messages import (
    ModelStatesEncoder,
    encode_odometry,
    encode_pose_array,
    encode_pose_stamped,
    encode_pose_with_covariance,
    encode_spatial_transform,
    encode_tf,
    encode_transform,
)
from diff_encoder_sim.drives.sensor_messages import (
    SentGoal,
    encode_clock,
    encode_command,
    encode_encoder_pulse,
    encode_goal,
    encode_joint_state,
    encode_map,
    encode_map_metadata,
    encode_result,
    encode_scan,
    encode_string,
)
from diff_encoder_sim.drives.topics import TOPICS
from diff_encoder_sim.drives.typestore import definition
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


def ros_class(name):
    return ModelStates if name == 'gazebo_msgs/ModelStates' else get_message_class(name)


@pytest.mark.parametrize('message_type', sorted({topic.message_type for topic in TOPICS}))
def test_definitions_are_those_of_the_installed_classes(message_type):
    name = message_type.replace('/msg/', '/')
    ours = definition(message_type)
    assert ours.md5sum == ros_class(name)._md5sum
    assert ours.has_header == ros_class(name)._has_header
    for part, built in generate_dynamic(name, ours.text).items():
        installed = ros_class(part)
        assert (built._md5sum, built.__slots__, built._slot_types) == (
            installed._md5sum,
            installed.__slots__,
            installed._slot_types,
        )


def test_of_the_simulator(rng):
    now_ns, joints, scan = values.stamp_ns(rng), values.joints(rng), values.scan(rng)
    assert encode_clock(now_ns) == serialised(Clock(conversions.stamp_from_ns(now_ns)))
    assert encode_joint_state(joints) == serialised(fields.joint_state_message(joints))
    assert encode_scan(scan, 'laser', 0.1) == serialised(fields.scan_message(scan, 'laser', 0.1))


def test_model_states(rng):
    world, body = values.world(rng), values.body(rng)
    expected = ModelStates(name=[*(model.name for model in world.models), 'alto'])
    for pose, twist in (
        *((conversions.matrix_pose_message(model.pose_in_world), Twist()) for model in world.models),
        conversions.body_messages(body),
    ):
        expected.pose.append(pose)
        expected.twist.append(twist)
    assert ModelStatesEncoder(world, 'alto').encode(body) == serialised(expected)


def test_of_encoder_and_odometry(rng):
    sample, estimate = values.encoder_sample(rng), values.estimate(rng)
    assert encode_encoder_pulse(sample, values.JOINTS) == serialised(
        fields.encoder_pulse_message(sample, values.JOINTS)
    )
    assert encode_odometry(estimate, 'odom', 'base_link') == serialised(
        fields.odometry_message(estimate, 'odom', 'base_link')
    )


def test_poses(rng):
    pose, covariance, now_ns = values.pose(rng), values.covariance(rng, 3), values.stamp_ns(rng)
    assert encode_pose_stamped(pose, now_ns, 'map') == serialised(conversions.pose_stamped_message(pose, now_ns, 'map'))
    assert encode_pose_with_covariance(pose, covariance, now_ns, 'map') == serialised(
        conversions.pose_with_covariance_message(pose, covariance, now_ns, 'map')
    )


def test_pose_arrays(rng):
    poses, now_ns = rng.normal(size=(5, 3)), values.stamp_ns(rng)
    read = PoseArray().deserialize(encode_pose_array(poses, now_ns, 'map'))
    assert (conversions.ns_from_stamp(read.header.stamp), read.header.frame_id) == (now_ns, 'map')
    assert np.array([conversions.pose_from_message(pose) for pose in read.poses]) == pytest.approx(poses)
    assert serialised(read) == encode_pose_array(poses, now_ns, 'map')


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


def test_commands_and_texts(rng):
    linear_mps, angular_radps = values.floats(rng, 2)
    assert encode_command(linear_mps, angular_radps) == serialised(
        Twist(Vector3(linear_mps, 0, 0), Vector3(0, 0, angular_radps))
    )
    assert encode_string('{"outcome": "größer"}') == serialised(String('{"outcome": "größer"}'))


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
