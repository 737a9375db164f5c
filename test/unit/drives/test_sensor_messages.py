"""Messages of wheels, scans, commands, goals and maps: rosbags reads them, and would write the same bytes."""

import numpy as np
import pytest

import message_values as values
from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.drives.sensor_messages import (
    JointDecoder,
    SentGoal,
    decode_command,
    decode_scan,
    decode_wheel_speeds,
    encode_clock,
    encode_command,
    encode_encoder_pulse,
    encode_goal,
    encode_joint_state,
    encode_map,
    encode_map_metadata,
    encode_result,
    encode_scan,
    encode_wheel_speeds,
)
from diff_encoder_sim.drives.topics import ENCODER_PULSE_TYPE, JOINT_STATE_TYPE
from diff_encoder_sim.navigation.navigator_inputs import GoalStatus
from diff_encoder_sim.simulation.state import JointStates
from message_checks import check_header, check_pose, read, stamp_ns, vector
from reencoding_drives import MAKERS


def test_clock(rng):
    now_ns = values.stamp_ns(rng)
    assert stamp_ns(read(encode_clock(now_ns), 'rosgraph_msgs/msg/Clock').clock) == now_ns


def test_twist(rng):
    linear_mps, angular_radps = values.floats(rng, 2)
    message = read(encode_command(linear_mps, angular_radps), 'geometry_msgs/msg/Twist')
    assert vector(message.linear) == (linear_mps, 0.0, 0.0)
    assert vector(message.angular) == (0.0, 0.0, angular_radps)


def test_a_command_is_decoded_as_it_was_encoded(rng):
    command = tuple(values.floats(rng, 2))
    assert decode_command(encode_command(*command)) == command
    with pytest.raises(InputFault, match='torn'):
        decode_command(encode_command(*command)[:-1])


NAMES = (('left', 'right'), ('a', 'bb', 'ccc', 'dddd', 'räder'), (), ('x',))


def test_joint_states(rng):
    joints = values.joints(rng)
    message = read(encode_joint_state(joints), 'sensor_msgs/msg/JointState')
    check_header(message.header, joints.stamp_ns, '')
    assert tuple(message.name) == joints.names
    assert (tuple(message.position), tuple(message.velocity)) == (joints.angles_rad, joints.speeds_radps)
    assert len(message.effort) == 0


def test_encoder_pulses(rng):
    sample = values.encoder_sample(rng)
    message = read(encode_encoder_pulse(sample, values.JOINTS), 'diff_encoder_sim/msg/EncoderPulse')
    check_header(message.header, sample.stamp_ns, '')
    assert tuple(message.name) == values.JOINTS
    assert tuple(message.pulses) == (sample.left_pulses, sample.right_pulses)


def test_wheel_speeds(rng):
    now_ns, speeds_radps = values.stamp_ns(rng), tuple(values.floats(rng, 2))
    message = read(encode_wheel_speeds(now_ns, speeds_radps, values.JOINTS), 'sensor_msgs/msg/JointState')
    check_header(message.header, now_ns, '')
    assert (tuple(message.name), tuple(message.velocity)) == (values.JOINTS, speeds_radps)
    assert len(message.position) == len(message.effort) == 0


@MAKERS
def test_joint_states_that_rosbags_encodes(maker):
    rng, decoder = np.random.default_rng(1), JointDecoder(JOINT_STATE_TYPE, maker.is_ros2)
    for _ in range(200):
        names, stamp_ns = NAMES[rng.integers(len(NAMES))], int(rng.integers(0, 2**31 * 10**9))
        message = maker.joint_state(stamp_ns, rng.normal(size=rng.integers(0, 6)), names)
        message.header.frame_id = 'frame'[: rng.integers(6)]
        decoded = decoder.decode(maker.raw(message))
        assert decoded.stamp_ns == stamp_ns and decoded.names == names
        assert list(decoded.values) == message.position.tolist()


@MAKERS
def test_encoder_pulses_that_rosbags_encodes(maker):
    decoder = JointDecoder(ENCODER_PULSE_TYPE, maker.is_ros2)
    for counts in ([2**63 - 1, -(2**63)], [0, -1], [5]):
        assert list(decoder.decode(maker.raw(maker.pulses(7, counts))).values) == counts


def test_wheel_speeds_behind_angles_are_found():
    joints = JointStates(7, ('left', 'right'), (1.0, 2.0), (3.0, 4.0))
    assert decode_wheel_speeds(encode_joint_state(joints)) == (7, (3.0, 4.0))


def test_scan(rng):
    scan = values.scan(rng)
    message = read(encode_scan(scan, 'laser', 0.1), 'sensor_msgs/msg/LaserScan')
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


@MAKERS
def test_scans_that_rosbags_encodes(maker):
    ranges = np.array([0.5, np.inf, np.nan], np.float32)
    message = maker.scan(7, ranges, 'front')
    decoded, frame = decode_scan(maker.raw(message), maker.is_ros2)
    assert (decoded.stamp_ns, frame) == (7, 'front')
    assert decoded[1:5] == (message.angle_min, message.angle_increment, message.range_min, message.range_max)
    assert np.array_equal(decoded.ranges_m, ranges, equal_nan=True)


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
