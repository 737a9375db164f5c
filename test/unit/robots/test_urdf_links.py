"""A URDF's <link>: mass, shapes, friction."""

from xml.etree import ElementTree

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.robot_tree import Box, Cylinder, Mesh, Sphere
from diff_encoder_sim.robots.urdf_reading import parse_link


def parse(body, notes=None):
    element = ElementTree.fromstring(f'<link name="l">{body}</link>')
    return parse_link(element, 'r.urdf', [] if notes is None else notes)


def collision(geometry, inside=''):
    return f'<collision>{inside}<geometry>{geometry}</geometry></collision>'


def test_the_inertia_is_turned_into_the_links_axes():
    inertial = parse(
        '<inertial><origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/><mass value="2"/>'
        '<inertia ixx="1" iyy="2" izz="2.5" ixy="0.1" ixz="0.2" iyz="0.3"/></inertial>'
    ).inertial
    assert (inertial.mass_kg, list(inertial.com_in_link_m)) == (2, [1, 0, 0])
    expected = np.array([[2, -0.1, -0.3], [-0.1, 1, 0.2], [-0.3, 0.2, 2.5]])
    assert inertial.inertia_kgm2 == pytest.approx(expected)


def test_a_link_without_inertial_has_no_mass():
    assert parse('').inertial is None
    assert parse('<inertial/>').inertial is None


@pytest.mark.parametrize(
    ('geometry', 'expected'),
    [
        ('<box size="1 2 3"/>', Box((1, 2, 3))),
        ('<sphere radius="0.5"/>', Sphere(0.5)),
        ('<cylinder radius="0.5" length="2"/>', Cylinder(0.5, 2)),
        ('<capsule radius="0.5" length="2"/>', Cylinder(0.5, 3)),
        ('<mesh filename=" package://p/a.stl "/>', Mesh('package://p/a.stl', (1, 1, 1))),
        ('<mesh filename="a.stl" scale="0.001 -0.001 0.001"/>', Mesh('a.stl', (0.001, -0.001, 0.001))),
    ],
)
def test_shapes_are_read(geometry, expected):
    (shape,) = parse(collision(geometry, '<origin xyz="0 0 0.1"/>')).collisions
    assert shape.geometry == expected
    assert list(shape.pose_in_link[:3, 3]) == [0, 0, 0.1]


@pytest.mark.parametrize('geometry', ['', '<plane/>', '<box size="0 0 0"/>', '<sphere radius="0"/>'])
def test_a_collision_that_nothing_can_hit_is_ignored_and_noted(geometry):
    notes = []
    assert parse(collision(geometry), notes).collisions == ()
    assert notes == ["link 'l': a <collision> without a shape or of size zero is ignored"]


def test_a_bad_visual_does_not_matter():
    good, bad = (
        '<visual><geometry><box size="1 1 1"/></geometry></visual>',
        '<visual><geometry><box/></geometry></visual>',
    )
    link = parse(bad + good + '<visual/>')
    assert [shape.geometry for shape in link.visuals] == [Box((1, 1, 1))]


def test_friction_is_that_of_pybullets_tag():
    assert parse('<contact><lateral_friction value="0.25"/></contact>').friction == 0.25
    assert parse('<contact/>').friction is None


@pytest.mark.parametrize(
    ('body', 'complaint'),
    [
        ('<inertial><mass value="-1"/></inertial>', "mass value: given '-1'; allowed: at least "),
        ('<inertial><mass value="1e-300"/></inertial>', "mass value: given '1e-300'; allowed: at least "),
        ('<inertial><mass value="7_0"/></inertial>', "mass value: given '7_0'"),
        ('<inertial><mass value="nan"/></inertial>', "mass value: given 'nan'"),
        ('<inertial><mass/></inertial>', 'mass value: given None'),
        ('<inertial><mass value="1e300"/></inertial>', "mass value: given '1e300'; allowed: from"),
        ('<inertial><mass value="1"/><inertia ixx="a"/></inertial>', "inertia ixx: given 'a'"),
        ('<inertial><mass value="1"/><origin xyz="0 0"/></inertial>', "inertial: origin xyz: given '0 0'"),
        (collision('<box size="1 -1 1"/>'), "collision: box size: given '1 -1 1'; allowed: lengths greater than 0 [m]"),
        (collision('<box size="1 1"/>'), "box size: given '1 1'; allowed: 3"),
        (collision('<box/>'), 'box size: given None'),
        (collision('<cylinder radius="1"/>'), 'cylinder length: given None'),
        (collision('<sphere radius="-1"/>'), "sphere radius: given '-1'"),
        (collision('<sphere radius="1 m"/>'), "sphere radius: given '1 m'"),
        (collision('<mesh/>'), 'mesh: filename: missing'),
        (collision('<mesh filename="a" scale="1"/>'), "mesh scale: given '1'"),
        (collision('<mesh filename="a" scale="1 0 1"/>'), 'allowed: not zero'),
        ('<contact><lateral_friction value="-1"/></contact>', "lateral_friction value: given '-1'"),
    ],
)
def test_a_bad_number_is_named(body, complaint):
    with pytest.raises(ConfigError) as caught:
        parse(body)
    assert str(caught.value).startswith("r.urdf: link 'l': ") and complaint in str(caught.value)
