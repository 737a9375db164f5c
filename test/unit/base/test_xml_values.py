"""Numbers and rotations from the XML of SDF and URDF files."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.xml_values import (
    bounded_numbers,
    parse_lengths,
    parse_numbers,
    rotation_from_rpy,
    rpy_from_rotation,
)


@pytest.mark.parametrize(
    ('read', 'text'),
    [(parse_numbers, text) for text in (None, '1', '1 2 3', '1 x', '1 nan')]
    + [(bounded_numbers, '1 1e9'), (parse_lengths, '1 0')],
)
def test_numbers_that_are_not_as_they_should_be_are_refused_by_name(read, text):
    assert read('1 2.5', 2, 'size') == [1.0, 2.5]
    with pytest.raises(ConfigError, match='a file: size: given .*; allowed: '):
        read(text, 2, 'a file: size')


@pytest.mark.parametrize('pitch_rad', [0.0, 0.3, -1.2, math.pi / 2, -math.pi / 2])
def test_rotations_are_about_fixed_axes_in_the_order_x_y_z_and_back(pitch_rad):
    assert rotation_from_rpy(math.pi / 2, 0, math.pi / 2) @ [0, 1, 0] == pytest.approx([0, 0, 1])
    for roll_rad, yaw_rad in [(0, 0), (0.4, -2.5), (math.pi, 1), (-3, math.pi / 2)]:
        rotation = rotation_from_rpy(roll_rad, pitch_rad, yaw_rad)
        assert rotation @ rotation.T == pytest.approx(np.eye(3))
        assert rotation_from_rpy(*rpy_from_rotation(rotation)) == pytest.approx(rotation, abs=1e-12)
