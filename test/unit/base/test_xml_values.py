"""Numbers, rotations and joints from the XML of SDF and URDF files."""

import math
from xml.etree import ElementTree

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.xml_values import (
    joint_origin,
    parse_lengths,
    parse_numbers,
    rotation_from_rpy,
    rpy_from_rotation,
)

JOINT = """<joint name="j"><parent link="base"/>{}</joint>"""


@pytest.mark.parametrize('text', [None, '', '1 2', '1 2 3 4', '1 2 x', '1 2 nan', '1 inf 3'])
def test_numbers_that_are_not_as_many_and_finite_are_refused_by_name(text):
    with pytest.raises(ConfigError, match='a file: size: given .*; allowed: 3 finite number'):
        parse_numbers(text, 3, 'a file: size')


def test_lengths_are_greater_than_0():
    assert parse_lengths('1 2.5', 2, 'size') == [1.0, 2.5]
    with pytest.raises(ConfigError, match='size: given .1 0.; allowed: lengths greater than 0'):
        parse_lengths('1 0', 2, 'size')


def test_a_joint_without_an_origin_is_where_its_parent_link_is():
    joint = ElementTree.fromstring(JOINT.format(''))
    assert joint_origin(joint) == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    turned = ElementTree.fromstring(JOINT.format('<origin rpy="0 0.5 0"/>'))
    assert joint_origin(turned) == ((0.0, 0.0, 0.0), (0.0, 0.5, 0.0))


def test_rotations_are_about_fixed_axes_in_the_order_x_y_z():
    turned = rotation_from_rpy(math.pi / 2, 0, math.pi / 2) @ [0, 1, 0]
    assert turned == pytest.approx([0, 0, 1])
    assert rotation_from_rpy(0.1, 0.2, 0.3) @ rotation_from_rpy(0.1, 0.2, 0.3).T == pytest.approx(np.eye(3))


@pytest.mark.parametrize('pitch_rad', [0.0, 0.3, -1.2, math.pi / 2, -math.pi / 2])
def test_angles_of_a_rotation_give_the_rotation_again(pitch_rad):
    for roll_rad, yaw_rad in [(0, 0), (0.4, -2.5), (math.pi, 1), (-3, math.pi / 2)]:
        rotation = rotation_from_rpy(roll_rad, pitch_rad, yaw_rad)
        assert rotation_from_rpy(*rpy_from_rotation(rotation)) == pytest.approx(rotation, abs=1e-12)


def test_a_bad_origin_is_named_with_its_file():
    joint = ElementTree.fromstring(JOINT.format('<origin xyz="1 0"/>'))
    with pytest.raises(ConfigError, match="robot.urdf: joint 'j' origin xyz: given '1 0'"):
        joint_origin(joint, 'robot.urdf: ')
