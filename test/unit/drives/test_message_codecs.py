"""Encoded messages are the bytes that rosbags writes; decoded ones those of rosbags or our own, or torn."""

import numpy as np
import pytest

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives import message_decoders as decoders
from diff_encoder_sim.drives import message_encoders as encoders
from diff_encoder_sim.drives.message_decoders import POSE_TYPES, JointDecoder, PoseDecoder
from diff_encoder_sim.drives.message_encoders import ModelStatesEncoder
from diff_encoder_sim.drives.topics import ENCODER_PULSE_TYPE, JOINT_STATE_TYPE
from diff_encoder_sim.simulation.state import JointStates
from message_values import (
    encoded_and_expected,
    header,
    planar,
    random_body,
    random_floats,
    random_pose,
    random_stamp_ns,
    random_world,
    raw,
)
from reencoding_drives import MAKERS, POSE

NAMES = (('left', 'right'), ('a', 'bb', 'ccc', 'dddd', 'räder'), (), ('x',))


@pytest.fixture(name='rng', params=range(2))
def fixture_rng(request):
    return np.random.default_rng(request.param)


def test_encoded_messages_are_those_of_rosbags(rng):
    cases = list(encoded_and_expected(rng))
    assert len(cases) == 19
    for encoded, kind, *fields in cases:
        assert encoded == raw(kind, *fields), kind


def test_encoded_particles(rng):
    pose, now_ns = random_pose(rng), random_stamp_ns(rng)
    found = encoders.encode_pose_array(np.array([pose, pose]), now_ns, 'map')
    expected = raw('geometry_msgs/PoseArray', header(now_ns, 'map'), [planar(pose)] * 2)
    assert found[:-112] == expected[:-112]
    assert np.frombuffer(found[-112:]) == pytest.approx(np.frombuffer(expected[-112:]), rel=1e-12)


def test_commands_and_speeds(rng):
    command = tuple(random_floats(rng, 2))
    assert decoders.decode_command(encoders.encode_command(*command)) == command
    with pytest.raises(InputFault, match='torn'):
        decoders.decode_command(encoders.encode_command(*command)[:-1])
    joints = JointStates(7, ('left', 'right'), (1.0, 2.0), (3.0, 4.0))
    assert decoders.decode_wheel_speeds(encoders.encode_joint_state(joints)) == (7, (3.0, 4.0))


@MAKERS
def test_joint_states_and_encoder_pulses(maker):
    rng, decoder = np.random.default_rng(1), JointDecoder(JOINT_STATE_TYPE, maker.is_ros2)
    for _ in range(200):
        names, stamp_ns = NAMES[rng.integers(len(NAMES))], int(rng.integers(0, 2**31 * 10**9))
        message = maker.joint_state(stamp_ns, rng.normal(size=rng.integers(0, 6)), names)
        message.header.frame_id = 'frame'[: rng.integers(6)]
        assert decoder.decode(maker.raw(message)) == (stamp_ns, names, tuple(message.position.tolist()))
    decoder = JointDecoder(ENCODER_PULSE_TYPE, maker.is_ros2)
    for counts in ([2**63 - 1, -(2**63)], [5]):
        assert decoder.decode(maker.raw(maker.pulses(7, counts)))[2] == tuple(counts)


@MAKERS
@pytest.mark.parametrize('kind', POSE_TYPES)
def test_a_torn_message_is_a_fault_and_leaves_the_next_ones_as_they_are(maker, kind):
    raw = maker.raw(maker.pose(kind, 7, Pose2D(1.0, 2.0, 0.5)))
    learned, fresh = PoseDecoder(kind, maker.is_ros2), PoseDecoder(kind, maker.is_ros2)
    expected = learned.decode(raw)
    assert expected[:3] == (7, pytest.approx((1.0, 2.0, 0.5), abs=1e-15), 'map')
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


def test_the_state_of_one_model(rng):
    world, body = random_world(rng), random_body(rng)
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
