"""Decoded messages: those that rosbags or our encoders write, and torn ones."""

import numpy as np
import pytest

import message_values as values
from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives import message_decoders as decoders
from diff_encoder_sim.drives.message_decoders import POSE_TYPES, JointDecoder, PoseDecoder
from diff_encoder_sim.drives.message_encoders import ModelStatesEncoder, encode_command, encode_joint_state
from diff_encoder_sim.drives.topics import ENCODER_PULSE_TYPE, JOINT_STATE_TYPE
from diff_encoder_sim.simulation.state import JointStates
from reencoding_drives import MAKERS, POSE

NAMES = (('left', 'right'), ('a', 'bb', 'ccc', 'dddd', 'räder'), (), ('x',))


def test_commands_and_speeds(rng):
    command = tuple(values.floats(rng, 2))
    assert decoders.decode_command(encode_command(*command)) == command
    with pytest.raises(InputFault, match='torn'):
        decoders.decode_command(encode_command(*command)[:-1])
    joints = JointStates(7, ('left', 'right'), (1.0, 2.0), (3.0, 4.0))
    assert decoders.decode_wheel_speeds(encode_joint_state(joints)) == (7, (3.0, 4.0))


@MAKERS
def test_joint_states_and_encoder_pulses(maker):
    rng, decoder = np.random.default_rng(1), JointDecoder(JOINT_STATE_TYPE, maker.is_ros2)
    for _ in range(200):
        names, stamp_ns = NAMES[rng.integers(len(NAMES))], int(rng.integers(0, 2**31 * 10**9))
        message = maker.joint_state(stamp_ns, rng.normal(size=rng.integers(0, 6)), names)
        message.header.frame_id = 'frame'[: rng.integers(6)]
        decoded = decoder.decode(maker.raw(message))
        assert (decoded.stamp_ns, decoded.names, list(decoded.values)) == (stamp_ns, names, message.position.tolist())
    decoder = JointDecoder(ENCODER_PULSE_TYPE, maker.is_ros2)
    for counts in ([2**63 - 1, -(2**63)], [5]):
        assert list(decoder.decode(maker.raw(maker.pulses(7, counts))).values) == counts


@MAKERS
def test_scans(maker):
    ranges = np.array([0.5, np.inf, np.nan], np.float32)
    message = maker.scan(7, ranges, 'front')
    decoded, frame = decoders.decode_scan(maker.raw(message), maker.is_ros2)
    assert (decoded.stamp_ns, frame) == (7, 'front')
    assert decoded[1:5] == (message.angle_min, message.angle_increment, message.range_min, message.range_max)
    assert np.array_equal(decoded.ranges_m, ranges, equal_nan=True)


@MAKERS
@pytest.mark.parametrize('kind', POSE_TYPES)
def test_poses(maker, kind):
    rng, decoder = np.random.default_rng(2), PoseDecoder(kind, maker.is_ros2)
    for row in rng.uniform(-3.0, 3.0, (20, 3)).tolist():
        now_ns = int(rng.integers(0, 2**31 * 10**9))
        found = decoder.decode(maker.raw(maker.pose(kind, now_ns, Pose2D(*row))))
        assert (found.stamp_ns, found.parent_frame) == (now_ns, 'map')
        assert found.pose == pytest.approx(row, abs=1e-15)


@MAKERS
@pytest.mark.parametrize('kind', POSE_TYPES)
def test_a_torn_message_is_a_fault_and_leaves_the_next_ones_as_they_are(maker, kind):
    raw = maker.raw(maker.pose(kind, 7, Pose2D(1.0, 2.0, 0.5)))
    learned, fresh = PoseDecoder(kind, maker.is_ros2), PoseDecoder(kind, maker.is_ros2)
    expected = learned.decode(raw)
    pose_end = raw.index(np.array([1.0, 2.0, 0.0]).tobytes()) + 56
    for size in range(pose_end):
        for decoder in (learned, fresh):
            with pytest.raises(InputFault):
                decoder.decode(raw[:size])
        assert learned.decode(raw) == expected
    assert fresh.decode(raw) == expected


@MAKERS
@pytest.mark.parametrize('row', [(0.0, np.inf, 0.0), (0.0, 0.0, np.nan), (1e200, 0.0, 0.0)])
def test_a_pose_that_is_not_finite_is_a_fault(maker, row):
    with pytest.raises(InputFault, match=r'position .* expected finite numbers|is no rotation'):
        PoseDecoder(POSE, maker.is_ros2).decode(maker.raw(maker.pose(POSE, 7, Pose2D(*row))))


@MAKERS
def test_transforms(maker):
    sent = [
        maker.transform(5, Pose2D(1.0, 2.0, 0.5), '/map', 'odom'),
        maker.transform(6, Pose2D(-1.0, 0.0, -3.0), 'odom', 'base_link'),
    ]
    found = list(decoders.decode_tf(maker.raw(maker.tf(*sent)), maker.is_ros2))
    frames = [(pose.stamp_ns, pose.parent_frame, pose.child_frame) for pose in found]
    assert frames == [(5, 'map', 'odom'), (6, 'odom', 'base_link')]
    assert found[1].pose == pytest.approx((-1.0, 0.0, -3.0))


def test_the_state_of_one_model(rng):
    world, body = values.world(rng), values.body(rng)
    raw = ModelStatesEncoder(world, 'alto').encode(body)
    assert decoders.decode_model_state(raw, 'alto') == body
    assert decoders.decode_model_state(raw, 'walls').position_xyz_m == tuple(world.models[1].pose_in_world[:3, 3])
    with pytest.raises(InputFault, match="no model 'robot'; expected it among"):
        decoders.decode_model_state(raw, 'robot')
    for size in range(len(raw)):
        with pytest.raises(InputFault):
            decoders.decode_model_state(raw[:size], 'alto')


@pytest.mark.parametrize('raw', [b'', b'\0\0\0\0'])
def test_a_foreign_byte_order_is_a_fault(raw):
    with pytest.raises(InputFault, match='not little-endian CDR'):
        decoders.FieldReader(raw, is_cdr=True)
