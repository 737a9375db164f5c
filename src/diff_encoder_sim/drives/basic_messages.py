"""Messages of one field or two: String, Clock and Twist."""

from __future__ import annotations

from typing import Tuple

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.drives.field_reader import FieldReader
from diff_encoder_sim.drives.primitives import NUMBER_SIZE, TWIST, encode_text, encode_time, encode_twist


def encode_clock(stamp_ns: int) -> bytes:
    """Encode rosgraph_msgs/Clock."""
    return encode_time(stamp_ns)


def encode_command(linear_mps: float, angular_radps: float) -> bytes:
    """Encode geometry_msgs/Twist of a velocity command."""
    return encode_twist((linear_mps, 0.0, 0.0), (0.0, 0.0, angular_radps))


def decode_command(raw: bytes, is_cdr: bool = False) -> Tuple[float, float]:
    """Decode a geometry_msgs/Twist: linear [m/s] and angular [rad/s] of a robot on the floor.

    Raises:
        InputFault: the message is torn.
    """
    linear_mps, _, _, _, _, angular_radps = FieldReader(raw, is_cdr).unpack(TWIST, NUMBER_SIZE)
    return linear_mps, angular_radps


def encode_string(text: str) -> bytes:
    """Encode std_msgs/String."""
    return encode_text(text)


def decode_string(raw: bytes, is_cdr: bool = False) -> str:
    """Decode a std_msgs/String.

    Raises:
        InputFault: the message is torn, or not UTF-8.
    """
    try:
        return FieldReader(raw, is_cdr).text('strict')
    except UnicodeDecodeError:
        raise InputFault('a text is not UTF-8') from None
