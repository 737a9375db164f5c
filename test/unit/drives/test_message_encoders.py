"""Encoded messages: rosbags reads them, and would write the same bytes."""

import math

import numpy as np
import pytest

import message_values as values
from diff_encoder_sim.base.se2 import yaw_from_quat_xyzw
from diff_encoder_sim.drives.message_encoders import (
    UNKNOWN_VARIANCE,
    ModelStatesEncoder,
    SentGoal,
    encode_clock,
    encode_command,
    encode_encoder_pulse,
    encode_goal,
    encode_joint_state,
    encode_map,
    encode_map_metadata,
    encode_odometry,
    encode_pose_array,
    encode_pose_stamped,
    encode_pose_with_covariance,
    encode_result,
    encode_scan,
    encode_spatial_transform,
    encode_tf,
    encode_transform,
    encode_wheel_speeds,
)
from diff_encoder_sim.navigation.navigator_inputs import GoalStatus
from message_checks import check_header, check_pose, quat, read, stamp_ns, vector


def test_clock_and_command(rng):
    now_ns, (linear_mps, angular_radps) = values.stamp_ns(rng), values.floats(rng, 2)
    assert stamp_ns(read(encode_clock(now_ns), 'rosgraph_msgs/msg/Clock').clock) == now_ns
    message = read(encode_command(linear_mps, angular_radps), 'geometry_msgs/msg/Twist')
    assert (vector(message.linear), vector(message.angular)) == ((linear_mps, 0.0, 0.0), (0.0, 0.0, angular_radps))


def test_joint_states(rng):
    joints = values.joints(rng)
    message = read(encode_joint_state(joints), 'sensor_msgs/msg/JointState')
    check_header(message.header, joints.stamp_ns, '')
    assert tuple(message.name) == joints.names
    assert (tuple(message.position), tuple(message.velocity)) == (joints.angles_rad, joints.speeds_radps)
    assert len(message.effort) == 0


def test_counts_and_speeds_of_wheels(rng):
    sample, speeds_radps = values.encoder_sample(rng), tuple(values.floats(rng, 2))
    message = read(encode_encoder_pulse(sample, values.JOINTS), 'diff_encoder_sim/msg/EncoderPulse')
    check_header(message.header, sample.stamp_ns, '')
    assert tuple(message.name) == values.JOINTS
    assert tuple(message.pulses) == (sample.left_pulses, sample.right_pulses)
    message = read(encode_wheel_speeds(sample.stamp_ns, speeds_radps, values.JOINTS), 'sensor_msgs/msg/JointState')
    check_header(message.header, sample.stamp_ns, '')
    assert (tuple(message.name), tuple(message.velocity)) == (values.JOINTS, speeds_radps)
    assert len(message.position) == len(message.effort) == 0


def test_odometry(rng):
    estimate = values.estimate(rng)._replace(lateral_velocity_mps=0.125)
    message = read(encode_odometry(estimate, 'odom', 'base_link'), 'nav_msgs/msg/Odometry')
    check_header(message.header, estimate.stamp_ns, 'odom')
    assert message.child_frame_id == 'base_link'
    check_pose(message.pose.pose, estimate.base_pose_in_odom)
    assert vector(message.twist.twist.linear) == (estimate.linear_velocity_mps, 0.125, 0.0)
    assert vector(message.twist.twist.angular) == (0.0, 0.0, estimate.angular_velocity_radps)
    for part, planar, axes in (
        (message.pose, estimate.pose_covariance, [0, 1, 5]),
        (message.twist, estimate.twist_covariance, [0, 5]),
    ):
        expected = np.diag([UNKNOWN_VARIANCE] * 6)
        expected[np.ix_(axes, axes)] = planar
        assert np.array_equal(part.covariance.reshape(6, 6), expected)


def test_stamped_poses(rng):
    pose, covariance, now_ns = values.pose(rng), values.covariance(rng, 3), values.stamp_ns(rng)
    message = read(encode_pose_stamped(pose, now_ns, 'map'), 'geometry_msgs/msg/PoseStamped')
    check_header(message.header, now_ns, 'map')
    check_pose(message.pose, pose)
    raw = encode_pose_with_covariance(pose, covariance, now_ns, 'map')
    message = read(raw, 'geometry_msgs/msg/PoseWithCovarianceStamped')
    check_header(message.header, now_ns, 'map')
    check_pose(message.pose.pose, pose)
    expected = np.zeros((6, 6))  # amcl's: zero for the other axes
    expected[np.ix_([0, 1, 5], [0, 1, 5])] = covariance
    assert np.array_equal(message.pose.covariance.reshape(6, 6), expected)
    message = read(encode_pose_array(np.array([pose, pose]), now_ns, 'map'), 'geometry_msgs/msg/PoseArray')
    check_header(message.header, now_ns, 'map')
    check_pose(message.poses[1], pose)


def test_transforms(rng):
    pose, now_ns = values.pose(rng), values.stamp_ns(rng)
    translation, rotation = values.floats(rng, 3), values.quat_xyzw(rng)
    raw = encode_tf(
        encode_transform(pose, now_ns, 'map', 'odom'),
        encode_spatial_transform(translation, rotation, now_ns + 1, 'base_link', 'left_wheel'),
    )
    planar, spatial = read(raw, 'tf2_msgs/msg/TFMessage').transforms
    check_header(planar.header, now_ns, 'map')
    assert (planar.child_frame_id, spatial.child_frame_id) == ('odom', 'left_wheel')
    assert vector(planar.transform.translation) == (pose.x_m, pose.y_m, 0.0)
    assert quat(planar.transform.rotation) == (0.0, 0.0, math.sin(0.5 * pose.yaw_rad), math.cos(0.5 * pose.yaw_rad))
    check_header(spatial.header, now_ns + 1, 'base_link')
    assert (vector(spatial.transform.translation), quat(spatial.transform.rotation)) == (translation, rotation)


def test_scan(rng):
    scan = values.scan(rng)
    message = read(encode_scan(scan, 'laser', 0.1), 'sensor_msgs/msg/LaserScan')
    check_header(message.header, scan.stamp_ns, 'laser')
    assert np.array_equal(message.ranges, scan.ranges_m.astype(np.float32)) and len(message.intensities) == 0
    angles = message.angle_min, message.angle_max, message.angle_increment
    expected = scan.angle_min_rad, scan.bearings_rad()[-1], scan.angle_increment_rad
    assert angles == pytest.approx(expected, abs=1e-6)
    times = message.time_increment, message.scan_time
    assert (*times, message.range_min, message.range_max) == pytest.approx((0.0, 0.1, 0.15, 6.0))


SENT = SentGoal('/navigation_trial_node', 3, 5_610_000_000)


def test_goal(rng):
    pose, now_ns = values.pose(rng), values.stamp_ns(rng)
    message = read(encode_goal(SENT, pose, now_ns, 'map'), 'move_base_msgs/msg/MoveBaseActionGoal')
    check_header(message.header, SENT.stamp_ns, '')
    assert (message.goal_id.id, stamp_ns(message.goal_id.stamp)) == ('/navigation_trial_node-3-5.610', SENT.stamp_ns)
    check_header(message.goal.target_pose.header, now_ns, 'map')
    check_pose(message.goal.target_pose.pose, pose)


@pytest.mark.parametrize(
    ('status', 'number'), [(GoalStatus.PREEMPTED, 2), (GoalStatus.SUCCEEDED, 3), (GoalStatus.ABORTED, 4)]
)
def test_result(status, number):
    message = read(encode_result(SENT, status, 'wörtlich', 7), 'move_base_msgs/msg/MoveBaseActionResult')
    check_header(message.header, 7, '')
    assert (message.status.status, message.status.text) == (number, 'wörtlich')
    assert message.status.goal_id.id == '/navigation_trial_node-3-5.610'


def test_map_and_its_metadata(rng):
    grid, now_ns = values.grid(rng), values.stamp_ns(rng)
    message = read(encode_map(grid, now_ns, 'map'), 'nav_msgs/msg/OccupancyGrid')
    check_header(message.header, now_ns, 'map')
    assert np.array_equal(message.data.reshape(message.info.height, message.info.width), grid.cells)
    for info in (message.info, read(encode_map_metadata(grid, now_ns), 'nav_msgs/msg/MapMetaData')):
        assert (info.height, info.width) == grid.cells.shape
        assert info.resolution == pytest.approx(grid.resolution_m)
        assert stamp_ns(info.map_load_time) == now_ns
        check_pose(info.origin, grid.origin)


def test_model_states(rng):
    world, body = values.world(rng), values.body(rng)
    models = ModelStatesEncoder(world, 'alto')
    models.encode(values.body(rng))  # leaves no trace in the next one
    message = read(models.encode(body), 'gazebo_msgs/msg/ModelStates')
    assert message.name == ['floor', 'walls', 'pillars', 'alto']
    for model, pose, twist in zip(world.models, message.pose, message.twist):
        assert vector(pose.position) == tuple(model.pose_in_world[:3, 3])
        yaw_rad = yaw_from_quat_xyzw(*quat(pose.orientation))
        assert (np.cos(yaw_rad), np.sin(yaw_rad)) == pytest.approx(tuple(model.pose_in_world[:2, 0]))
        assert vector(twist.linear) == vector(twist.angular) == (0.0, 0.0, 0.0)
    pose, twist = message.pose[-1], message.twist[-1]
    assert (vector(pose.position), quat(pose.orientation), vector(twist.linear), vector(twist.angular)) == body
