"""Joint states and pulse counts: rosbags reads them, would write the same bytes, and decodes the same."""

import math

import numpy as np
import pytest

import message_values as values
from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.drives.message_types import ENCODER_PULSE, JOINT_STATE
from diff_encoder_sim.drives.sensor_messages import (
    JointDecoder,
    decode_wheel_speeds,
    encode_encoder_pulse,
    encode_joint_state,
    encode_wheel_speeds,
)
from diff_encoder_sim.simulation.state import JointStates
from message_checks import check_header, read
from reencoding_drives import MAKERS

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


def test_joint_states_are_decoded_as_they_were_encoded():
    rng, decoder = np.random.default_rng(1), JointDecoder(JOINT_STATE)
    for _ in range(20):
        joints = values.joints(rng)
        assert decoder.decode(encode_joint_state(joints)) == (joints.stamp_ns, joints.names, joints.angles_rad)


def test_encoder_pulses_are_decoded_as_they_were_encoded():
    rng, decoder = np.random.default_rng(1), JointDecoder(ENCODER_PULSE)
    for _ in range(20):
        sample = values.encoder_sample(rng)
        decoded = decoder.decode(encode_encoder_pulse(sample, values.JOINTS))
        assert decoded == (sample.stamp_ns, values.JOINTS, (sample.left_pulses, sample.right_pulses))


@MAKERS
def test_joint_states_that_rosbags_encodes(maker):
    rng, decoder = np.random.default_rng(1), JointDecoder(JOINT_STATE, maker.is_ros2)
    for _ in range(200):
        names, stamp_ns = NAMES[rng.integers(len(NAMES))], int(rng.integers(0, 2**31 * 10**9))
        message = maker.joint_state(stamp_ns, rng.normal(size=rng.integers(0, 6)), names)
        message.header.frame_id = 'frame'[: rng.integers(6)]
        decoded = decoder.decode(maker.raw(message))
        assert decoded.stamp_ns == stamp_ns and decoded.names == names
        assert list(decoded.values) == message.position.tolist()


@MAKERS
def test_encoder_pulses_that_rosbags_encodes(maker):
    decoder = JointDecoder(ENCODER_PULSE, maker.is_ros2)
    for counts in ([2**63 - 1, -(2**63)], [0, -1], [5]):
        assert list(decoder.decode(maker.raw(maker.pulses(7, counts))).values) == counts


@MAKERS
def test_a_torn_message_is_a_fault_wherever_it_is_torn(maker):
    joints = maker.raw(maker.joint_state(7, (1.0, 2.0)))
    decoder = JointDecoder(JOINT_STATE, maker.is_ros2)
    values_end = joints.index(np.array([1.0, 2.0]).tobytes()) + 16
    for size in range(values_end):
        with pytest.raises(InputFault):
            decoder.decode(joints[:size])
        with pytest.raises(InputFault):
            JointDecoder(JOINT_STATE, maker.is_ros2).decode(joints[:size])


@MAKERS
def test_a_torn_message_leaves_the_next_ones_as_they_are(maker):
    decoder = JointDecoder(JOINT_STATE, maker.is_ros2)
    raw = maker.raw(maker.joint_state(7, (1.0, 2.0)))
    expected = decoder.decode(raw)
    other = maker.raw(maker.joint_state(7, (1.0, 2.0, 3.0), ('a', 'b', 'c')))
    for size in range(other.index(np.array([1.0]).tobytes())):
        with pytest.raises(InputFault):
            decoder.decode(other[:size])
        assert decoder.decode(raw) == expected


@pytest.mark.parametrize('joints', [('left', 'right'), (), ('räder',)])
def test_wheel_speeds_are_decoded_as_they_were_encoded(joints):
    assert decode_wheel_speeds(encode_wheel_speeds(5_000_000_007, (1.5, -2.5), joints)) == (5_000_000_007, (1.5, -2.5))


def test_wheel_speeds_behind_angles_are_found():
    joints = JointStates(7, ('left', 'right'), (1.0, 2.0), (3.0, 4.0))
    assert decode_wheel_speeds(encode_joint_state(joints)) == (7, (3.0, 4.0))


@pytest.mark.parametrize('speeds', [(), (1.0,), (1.0, math.nan), (1.0, 2.0, 3.0)])
def test_speeds_that_are_not_those_of_two_wheels_are_a_fault(speeds):
    with pytest.raises(InputFault, match='2 finite numbers'):
        decode_wheel_speeds(encode_wheel_speeds(5, speeds, ('left', 'right')))


def test_torn_wheel_speeds_are_a_fault_wherever_they_are_torn():
    raw = encode_wheel_speeds(5, (1.5, -2.5), ('left', 'right'))
    for size in range(len(raw) - 4):  # behind the speeds come only the efforts
        with pytest.raises(InputFault):
            decode_wheel_speeds(raw[:size])
