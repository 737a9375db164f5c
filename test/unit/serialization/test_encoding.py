"""Messages as bytes: they say what they were made of, and rosbags would write the same bytes."""

import math
import re

import numpy as np
import pytest
from rosbags.typesys import get_types_from_msg

import message_values as values
from diff_encoder_sim.base.se2 import yaw_from_quat_xyzw
from diff_encoder_sim.navigation.goal_status import GoalStatus
from diff_encoder_sim.recording.topics import TOPICS
from diff_encoder_sim.serialization import encoding
from diff_encoder_sim.serialization.message_types import ENCODER_PULSE_FIELDS
from diff_encoder_sim.serialization.typestore import STORE, definition
from places import ROOT

SENT = encoding.SentGoal('/navigation_trial_node', 3, 5_610_000_000)

# Of upstream's packages and of msg/EncoderPulse.msg, as `rosmsg md5` gives them.
MD5SUMS = {
    'std_msgs/msg/String': '992ce8a1687cec8c8bd883ec73ca41d1',
    'rosgraph_msgs/msg/Clock': 'a9c97c1d230cfc112e270351a944ee47',
    'sensor_msgs/msg/JointState': '3066dcd76a6cfaef579bd0f34173e9fd',
    'gazebo_msgs/msg/ModelStates': '48c080191eb15c41858319b4d8a609c2',
    'geometry_msgs/msg/Twist': '9f195f881246fdfa2798d1d3eebca84a',
    'diff_encoder_sim/msg/EncoderPulse': '923c04331b3211ae663e32d722d8aff0',
    'nav_msgs/msg/Odometry': 'cd5e73d190d741a2f92e81eda573aca7',
    'geometry_msgs/msg/PoseStamped': 'd3812c3cbc69362b77dc0b19b345f8f5',
    'tf2_msgs/msg/TFMessage': '94810edda583a504dfda3829e70d7eec',
    'sensor_msgs/msg/LaserScan': '90c7ef2dc6895d81024acba2ac42f369',
    'geometry_msgs/msg/PoseWithCovarianceStamped': '953b798c0f514ff060a53a3498ce6246',
    'nav_msgs/msg/OccupancyGrid': '3381f2d731d4076ec5c71b0759edbe4e',
    'nav_msgs/msg/MapMetaData': '10cfc8a2818024d3248802c00c95f11b',
    'move_base_msgs/msg/MoveBaseActionGoal': '660d6895a1b9a16dce51fbdd9a64a56b',
    'move_base_msgs/msg/MoveBaseActionResult': '1eb06eeff08fa7ea874431638cb52332',
}


@pytest.fixture(params=range(5))
def rng(request):
    return np.random.default_rng(request.param)


def read(raw, message_type):
    """The message, after a look whether rosbags makes the same bytes of it."""
    message = STORE.deserialize_ros1(raw, message_type)
    assert bytes(STORE.serialize_ros1(message, message_type)) == raw
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


def test_every_recorded_type_is_upstreams():
    assert {topic.message_type: definition(topic.message_type).md5sum for topic in TOPICS} == MD5SUMS


def test_the_encoders_definition_is_that_of_its_msg_file():
    text = (ROOT / 'msg' / 'EncoderPulse.msg').read_text()
    name = 'diff_encoder_sim/msg/EncoderPulse'
    assert get_types_from_msg(text, name) == get_types_from_msg(ENCODER_PULSE_FIELDS, name)


def test_a_leading_header_is_known_as_such():
    assert {topic.message_type for topic in TOPICS if not definition(topic.message_type).has_header} == {
        'std_msgs/msg/String',
        'rosgraph_msgs/msg/Clock',
        'gazebo_msgs/msg/ModelStates',
        'geometry_msgs/msg/Twist',
        'tf2_msgs/msg/TFMessage',
        'nav_msgs/msg/MapMetaData',
    }


def test_clock(rng):
    now_ns = values.stamp_ns(rng)
    assert stamp_ns(read(encoding.clock_message(now_ns), 'rosgraph_msgs/msg/Clock').clock) == now_ns


def test_joint_states(rng):
    joints = values.joints(rng)
    message = read(encoding.joint_state_message(joints), 'sensor_msgs/msg/JointState')
    check_header(message.header, joints.stamp_ns, '')
    assert tuple(message.name) == joints.names
    assert (tuple(message.position), tuple(message.velocity)) == (joints.angles_rad, joints.speeds_radps)
    assert len(message.effort) == 0


def test_twist(rng):
    linear_mps, angular_radps = values.floats(rng, 2)
    message = read(encoding.twist_message(linear_mps, angular_radps), 'geometry_msgs/msg/Twist')
    assert vector(message.linear) == (linear_mps, 0.0, 0.0)
    assert vector(message.angular) == (0.0, 0.0, angular_radps)


def test_encoder_pulses(rng):
    sample = values.encoder_sample(rng)
    message = read(encoding.encoder_pulse_message(sample, values.JOINTS), 'diff_encoder_sim/msg/EncoderPulse')
    check_header(message.header, sample.stamp_ns, '')
    assert tuple(message.name) == values.JOINTS
    assert tuple(message.pulses) == (sample.left_pulses, sample.right_pulses)


def test_odometry(rng):
    estimate = values.estimate(rng)
    message = read(encoding.odometry_message(estimate, 'odom', 'base_link'), 'nav_msgs/msg/Odometry')
    check_header(message.header, estimate.stamp_ns, 'odom')
    assert message.child_frame_id == 'base_link'
    check_pose(message.pose.pose, estimate.base_pose_in_odom)
    assert vector(message.twist.twist.linear) == (estimate.linear_velocity_mps, 0.0, 0.0)
    assert vector(message.twist.twist.angular) == (0.0, 0.0, estimate.angular_velocity_radps)
    for part, planar, axes in (
        (message.pose, estimate.pose_covariance, [0, 1, 5]),
        (message.twist, estimate.twist_covariance, [0, 5]),
    ):
        expected = np.diag([encoding.UNKNOWN_VARIANCE] * 6)
        expected[np.ix_(axes, axes)] = planar
        assert np.array_equal(part.covariance.reshape(6, 6), expected)


def test_pose_stamped(rng):
    pose, now_ns = values.pose(rng), values.stamp_ns(rng)
    message = read(encoding.pose_stamped_message(pose, now_ns, 'map'), 'geometry_msgs/msg/PoseStamped')
    check_header(message.header, now_ns, 'map')
    check_pose(message.pose, pose)


def test_transforms(rng):
    pose, now_ns = values.pose(rng), values.stamp_ns(rng)
    translation, rotation = values.floats(rng, 3), values.quat_xyzw(rng)
    raw = encoding.tf_message(
        encoding.transform(pose, now_ns, 'map', 'odom'),
        encoding.spatial_transform(translation, rotation, now_ns + 1, 'base_link', 'left_wheel'),
    )
    planar, spatial = read(raw, 'tf2_msgs/msg/TFMessage').transforms
    check_header(planar.header, now_ns, 'map')
    assert (planar.child_frame_id, spatial.child_frame_id) == ('odom', 'left_wheel')
    assert vector(planar.transform.translation) == (pose.x_m, pose.y_m, 0.0)
    assert quat(planar.transform.rotation) == (0.0, 0.0, math.sin(0.5 * pose.yaw_rad), math.cos(0.5 * pose.yaw_rad))
    check_header(spatial.header, now_ns + 1, 'base_link')
    assert (vector(spatial.transform.translation), quat(spatial.transform.rotation)) == (translation, rotation)


def test_model_states(rng):
    world, body = values.world(rng), values.body(rng)
    models = encoding.ModelStatesMessages(world, 'alto')
    models.message(values.body(rng))  # what was said before leaves no trace
    message = read(models.message(body), 'gazebo_msgs/msg/ModelStates')
    assert message.name == ['floor', 'walls', 'pillars', 'alto']
    for model, pose, twist in zip(world.models, message.pose, message.twist):
        assert vector(pose.position) == tuple(model.pose_in_world[:3, 3])
        yaw_rad = yaw_from_quat_xyzw(*quat(pose.orientation))
        assert (np.cos(yaw_rad), np.sin(yaw_rad)) == pytest.approx(tuple(model.pose_in_world[:2, 0]))
        assert vector(twist.linear) == vector(twist.angular) == (0.0, 0.0, 0.0)
    pose, twist = message.pose[-1], message.twist[-1]
    assert (vector(pose.position), quat(pose.orientation), vector(twist.linear), vector(twist.angular)) == body


def test_scan(rng):
    scan = values.scan(rng)
    message = read(encoding.scan_message(scan, 'laser', 0.1), 'sensor_msgs/msg/LaserScan')
    check_header(message.header, scan.stamp_ns, 'laser')
    assert np.array_equal(message.ranges, scan.ranges_m.astype(np.float32))
    assert message.angle_max == pytest.approx(scan.bearings_rad()[-1], abs=1e-6)
    assert (
        message.angle_min,
        message.angle_increment,
        message.time_increment,
        message.scan_time,
        message.range_min,
        message.range_max,
    ) == pytest.approx((scan.angle_min_rad, scan.angle_increment_rad, 0.0, 0.1, 0.15, 6.0))
    assert len(message.intensities) == 0


def test_pose_with_covariance(rng):
    pose, covariance, now_ns = values.pose(rng), values.covariance(rng, 3), values.stamp_ns(rng)
    message = read(
        encoding.pose_with_covariance_message(pose, covariance, now_ns, 'map'),
        'geometry_msgs/msg/PoseWithCovarianceStamped',
    )
    check_header(message.header, now_ns, 'map')
    check_pose(message.pose.pose, pose)
    expected = np.zeros((6, 6))
    expected[np.ix_([0, 1, 5], [0, 1, 5])] = covariance
    assert np.array_equal(message.pose.covariance.reshape(6, 6), expected)


def test_map_and_its_metadata(rng):
    grid, now_ns = values.grid(rng), values.stamp_ns(rng)
    message = read(encoding.map_message(grid, now_ns, 'map'), 'nav_msgs/msg/OccupancyGrid')
    check_header(message.header, now_ns, 'map')
    assert np.array_equal(message.data.reshape(message.info.height, message.info.width), grid.cells)
    for info in (message.info, read(encoding.map_metadata_message(grid, now_ns), 'nav_msgs/msg/MapMetaData')):
        assert (info.height, info.width) == grid.cells.shape
        assert info.resolution == pytest.approx(grid.resolution_m)
        assert stamp_ns(info.map_load_time) == now_ns
        check_pose(info.origin, grid.origin)


def test_goal(rng):
    pose, now_ns = values.pose(rng), values.stamp_ns(rng)
    message = read(encoding.goal_message(SENT, pose, now_ns, 'map'), 'move_base_msgs/msg/MoveBaseActionGoal')
    check_header(message.header, SENT.stamp_ns, '')
    assert (message.goal_id.id, stamp_ns(message.goal_id.stamp)) == ('/navigation_trial_node-3-5.610', SENT.stamp_ns)
    check_header(message.goal.target_pose.header, now_ns, 'map')
    check_pose(message.goal.target_pose.pose, pose)


@pytest.mark.parametrize(
    ('status', 'number'), [(GoalStatus.PREEMPTED, 2), (GoalStatus.SUCCEEDED, 3), (GoalStatus.ABORTED, 4)]
)
def test_result(status, number):
    message = read(encoding.result_message(SENT, status, 'wörtlich', 7), 'move_base_msgs/msg/MoveBaseActionResult')
    check_header(message.header, 7, '')
    assert (message.status.status, message.status.text) == (number, 'wörtlich')
    assert message.status.goal_id.id == '/navigation_trial_node-3-5.610'


def test_only_a_goal_that_is_over_has_a_result():
    with pytest.raises(KeyError):
        encoding.result_message(SENT, GoalStatus.ACTIVE, '', 7)


@pytest.mark.parametrize('text', ['', '{"test": "SL"}', 'Prüfung\n'])
def test_text(text):
    assert read(encoding.text_message(text), 'std_msgs/msg/String').data == text


def test_the_topics_nodes_are_those_of_the_launch_files():
    launched = set()
    for path in (ROOT / 'launch').glob('*.launch'):
        launched.update(re.findall(r'<node name="(\w+)"', path.read_text()))
    assert {node.lstrip('/') for topic in TOPICS for node in topic.nodes} <= launched
