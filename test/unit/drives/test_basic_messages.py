"""Strings, clocks and velocity commands: rosbags reads them, and would write the same bytes."""

import pytest

import message_values as values
from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.drives.sensor_messages import (
    decode_command,
    decode_string,
    encode_clock,
    encode_command,
    encode_string,
)
from message_checks import read, stamp_ns, vector


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


@pytest.mark.parametrize('text', ['', '{"test": "SL"}', 'Prüfung\n'])
def test_text(text):
    assert read(encode_string(text), 'std_msgs/msg/String').data == text


@pytest.mark.parametrize('text', ['', '{"test": "SL"}', 'Prüfung\n', 'x' * 100_000])
def test_a_string_is_decoded_as_it_was_encoded(text):
    assert decode_string(encode_string(text)) == text


def test_a_string_that_is_torn_or_not_utf_8_is_a_fault():
    raw = encode_string('Prüfung')
    for size in range(len(raw)):
        with pytest.raises(InputFault, match='torn'):
            decode_string(raw[:size])
    with pytest.raises(InputFault, match='not UTF-8'):
        decode_string(raw.replace('ü'.encode(), b'\xfc\xfc'))
