"""The true poses of all models: rosbags reads them, and would write the same bytes."""

import numpy as np
import pytest

import message_values as values
from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import yaw_from_quat_xyzw
from diff_encoder_sim.drives.pose_messages import ModelStateDecoder, ModelStatesEncoder
from message_checks import quat, read, vector


def test_model_states(rng):
    world, body = values.world(rng), values.body(rng)
    models = ModelStatesEncoder(world, 'alto')
    models.encode(values.body(rng))  # what was said before leaves no trace
    message = read(models.encode(body), 'gazebo_msgs/msg/ModelStates')
    assert message.name == ['floor', 'walls', 'pillars', 'alto']
    for model, pose, twist in zip(world.models, message.pose, message.twist):
        assert vector(pose.position) == tuple(model.pose_in_world[:3, 3])
        yaw_rad = yaw_from_quat_xyzw(*quat(pose.orientation))
        assert (np.cos(yaw_rad), np.sin(yaw_rad)) == pytest.approx(tuple(model.pose_in_world[:2, 0]))
        assert vector(twist.linear) == vector(twist.angular) == (0.0, 0.0, 0.0)
    pose, twist = message.pose[-1], message.twist[-1]
    assert (vector(pose.position), quat(pose.orientation), vector(twist.linear), vector(twist.angular)) == body


def test_one_models_state_is_decoded_as_it_was_encoded(rng):
    world, body = values.world(rng), values.body(rng)
    raw, decoder = ModelStatesEncoder(world, 'alto').encode(body), ModelStateDecoder('alto')
    assert decoder.decode(raw) == decoder.decode(raw) == body
    assert ModelStateDecoder('walls').decode(raw).position_xyz_m == tuple(world.models[1].pose_in_world[:3, 3])
    other = ModelStatesEncoder(world, 'robot').encode(body)
    with pytest.raises(InputFault, match="no model 'alto'; expected it among"):
        decoder.decode(other)
    assert decoder.decode(raw) == body


def test_torn_states_are_a_fault_wherever_they_are_torn(rng):
    raw, decoder = ModelStatesEncoder(values.world(rng), 'alto').encode(values.body(rng)), ModelStateDecoder('alto')
    for size in range(len(raw)):
        with pytest.raises(InputFault):
            decoder.decode(raw[:size])
    decoder.decode(raw)
