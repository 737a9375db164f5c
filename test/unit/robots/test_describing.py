"""A robot's file, read as a whole."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.describing import describe
from diff_encoder_sim.robots.description import RobotChoices, RobotSource
from places import ROOT
from robot_parts import CUBE_CORNERS, CUBE_TRIANGLES, finder, write_binary_stl
from urdf_texts import base, described, found, inertial, joint, link, pair, robot, sphere, usual


def test_alto_is_found_as_it_is_without_a_warning():
    alto = describe(RobotSource(ROOT / 'urdf' / 'alto.urdf.xacro'))
    assert (alto.left.joint, alto.right.joint) == ('left_wheel_joint', 'right_wheel_joint')
    assert (alto.wheel_diameter_m, alto.wheel_separation_m) == pytest.approx((0.2, 0.4))
    assert (alto.mass.mass_kg, *alto.mass.com_m[:2]) == pytest.approx((80.0, 0.05, 0.0))
    assert [contact.name for contact in alto.contacts] == ['front_caster', 'rear_caster']
    assert alto.laser.link == 'laser'
    assert sorted(alto.footprint) == [(-0.25, -0.3), (-0.25, 0.3), (0.25, -0.3), (0.25, 0.3)]
    assert alto.warnings == () and alto.notes == ()


def test_a_file_that_was_edited_is_described_anew_and_one_that_was_not_is_not(tmp_path):
    source = RobotSource(tmp_path / 'robot.urdf')
    source.file.write_text(usual())
    first = describe(source)
    assert describe(source) is first
    source.file.write_text(usual().replace('name="made"', 'name="other"'))
    assert describe(source).tree.name == 'other'
    assert describe(source, RobotChoices(wheel_diameter=0.12)).wheel_diameter_m == 0.12


def test_all_other_joints_are_held_still_and_named_in_one_line():
    limits = '<limit lower="0" upper="1" effort="1" velocity="1"/>'
    lift = link('a') + joint('lift', 'a', '0 0 0.3', 'prismatic', inside=limits)
    pan = link('b') + joint('pan', 'b', '0 0 0.3', 'revolute', inside=limits)
    follower = link('c') + joint('follower', 'c', '0 0 0.3', 'continuous', inside='<mimic joint="pan"/>')
    (note,) = described(usual(lift, pan, follower)).notes
    assert note == 'joints held still at zero: lift (prismatic); pan (revolute); follower (continuous, mimic)'


def test_the_mass_is_that_of_all_links():
    load = f'<link name="load">{inertial(3.0, 0.01)}</link>' + joint('load_joint', 'load', '0.1 0 0.1')
    mass = described(usual(load)).mass
    assert mass.mass_kg == pytest.approx(2.0 + 2 * 0.1 + 3.0)
    assert mass.com_m[0] == pytest.approx((2.0 * 0.02 + 3.0 * 0.1) / 5.2)


def test_collision_meshes_become_primitives_with_a_note(tmp_path):
    write_binary_stl(tmp_path / 'cube.stl', 0.05 * CUBE_CORNERS, CUBE_TRIANGLES)
    mesh = link('case', '<mesh filename="package://any/cube.stl"/>') + joint('case_joint', 'case', '0 0 0.3')
    description = described(usual(mesh), find=finder(tmp_path))
    assert [note for note in description.notes if 'cube.stl' in note and 'box' in note]


def test_a_frame_without_collision_shapes_is_measured_by_its_visual_ones():
    seen = base().replace('<collision>', '<visual>').replace('</collision>', '</visual>')
    description = described(robot(seen, pair()))
    assert 'no link but the wheels has a collision shape: visual shapes are taken' in description.warnings
    assert max(x_m for x_m, _ in description.footprint) == pytest.approx(0.15)


def test_a_caster_that_can_only_be_seen_touches_all_the_same():
    seen = link('caster', sphere(0.02), shape='visual') + joint('j', 'caster', '0.1 0 0.02')
    assert [contact.name for contact in described(robot(base(), pair(), seen)).contacts] == ['caster']


def test_the_table_names_each_value_with_its_source():
    description = described(usual())
    assert found(description, 'base frame') == ('base_link', 'root link')
    assert found(description, 'mass [kg]') == ('2.2', '<inertial> of the links')
    assert [row.quantity for row in description.found][:2] == ['name', 'base frame']


def test_a_root_that_is_another_frames_name_is_refused():
    with pytest.raises(ConfigError, match="root link 'odom' is the name of a frame .*; allowed: the robot's base"):
        described(usual().replace('"base_link"', '"odom"'))
