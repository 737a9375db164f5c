"""Robots as the simulator loads them."""

from xml.etree import ElementTree

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.description import Cylinder, RobotChoices, RobotSource
from diff_encoder_sim.robots.meshes import primitives_of, visual_primitives_of
from diff_encoder_sim.robots.simulated_robot import (
    FLOOR_ONLY_LINKS,
    NO_ERRORS,
    GeometryErrors,
    joined_links,
    load_simulated_robot,
    needs_other_files,
    self_contained_urdf,
)
from diff_encoder_sim.robots.urdf_reading import parse_urdf
from diff_encoder_sim.robots.xacro_expansion import expand
from generated_robots import LEFT, RIGHT, Recipe, urdf_of
from places import ROOT
from robot_parts import CUBE_CORNERS, CUBE_TRIANGLES, finder, write_binary_stl

ALTO = RobotSource(ROOT / 'urdf' / 'alto.urdf.xacro')


def load(source=ALTO, errors=NO_ERRORS):
    return load_simulated_robot(source, RobotChoices(), errors)


@pytest.fixture
def generated(tmp_path):
    def source_of(**recipe):
        path = tmp_path / 'robot.urdf'
        path.write_text(urdf_of(Recipe(**recipe), tmp_path))
        return RobotSource(path)

    return source_of


def test_alto_is_table_1_of_the_paper():
    alto = load()
    assert alto.description.tree.name == 'alto'
    assert alto.wheels == pytest.approx((0.1, 0.1, 0.4))
    assert alto.description.mass.mass_kg == pytest.approx(80.0)


def test_a_sound_file_is_simulated_as_it_is():
    alto = load()
    assert (alto.urdf, alto.floor_only_links) == (joined_links(parse_urdf(expand(ALTO), '')), ())


def test_errors_are_arguments_of_a_file_that_has_them():
    alto = load(errors=GeometryErrors(0.01, -0.02, 0.05))
    assert alto.wheels == pytest.approx((0.101, 0.098, 0.42))
    assert alto.floor_only_links == ()
    assert alto.description.wheel_diameter_m == 0.2  # nominal


def test_arguments_that_have_another_effect_are_not_taken_for_errors(tmp_path):
    path = tmp_path / 'robot.urdf.xacro'
    path.write_text(
        ALTO.file.read_text().replace('* (1 + $(arg wheel_separation_error))', '+ $(arg wheel_separation_error)')
    )
    robot = load(RobotSource(path), GeometryErrors(separation=0.05))
    assert robot.wheels == pytest.approx((0.1, 0.1, 0.42))
    assert robot.floor_only_links == FLOOR_ONLY_LINKS


def test_errors_of_any_other_robot_are_applied_to_its_wheels(generated):
    robot = load(generated(), GeometryErrors(0.01, -0.02, 0.05))
    assert robot.wheels == pytest.approx((0.033 * 1.01, 0.033 * 0.98, 0.16 * 1.05))
    assert robot.joints == (LEFT, RIGHT)
    assert robot.floor_only_links == FLOOR_ONLY_LINKS


def test_a_joint_whose_axis_points_to_the_right_turns_backward_when_the_robot_drives_forward(generated):
    assert load(generated(has_mirrored_axes=True)).forward_signs == (1.0, -1.0)
    assert load(generated()).forward_signs == (1.0, 1.0)


def test_a_file_that_was_edited_is_read_again(generated):
    for radius_m in (0.05, 0.04, 0.05):
        assert load(generated(radius_m=radius_m)).wheels.left_radius_m == pytest.approx(radius_m)


def test_a_missing_joint_is_refused_with_the_file(generated):
    source = generated()
    with pytest.raises(ConfigError, match="robot.urdf: .*'wheel_left'.*missing") as caught:
        load_simulated_robot(source, RobotChoices('wheel_left', RIGHT))
    assert '\n' not in str(caught.value)


URDF = """
<robot name="made" xmlns:gz="http://gazebosim.org">
  <link name="base">
    <visual><geometry><mesh filename="package://p/seen.dae"/></geometry></visual>
    <collision name="hull">
      <origin xyz="1 2 3" rpy="0.1 0.2 0.3"/>
      <geometry><mesh filename="package://p/a.stl" scale="0.1 0.2 0.3"/></geometry>
    </collision>
    <collision><geometry><sphere radius="0.5"/></geometry></collision>
  </link>
  <joint name="j" type="fixed"><parent link="base"/><child link="top"/></joint>
  <link name="top"><collision><geometry><mesh filename="package://p/a.stl"/></geometry></collision></link>
  <gazebo><plugin filename="libgazebo_ros_diff_drive.so"><gz:x>1</gz:x></plugin></gazebo>
</robot>
"""


WHEEL = """
<robot name="made">
  <link name="base"><collision><geometry><box size="1 1 1"/></geometry></collision></link>
  <joint name="j" type="continuous"><parent link="base"/><child link="wheel"/><axis xyz="0 1 0"/></joint>
  <link name="wheel">
    <collision><geometry><mesh filename="package://p/a.stl"/></geometry></collision>
    <visual><geometry><mesh filename="package://p/drum.stl"/></geometry></visual>
    <visual><geometry><mesh filename="package://p/torn.stl"/></geometry></visual>
    <visual><geometry><mesh filename="package://p/missing.stl"/></geometry></visual>
  </link>
</robot>
"""


def no_file(_uri):
    return None


@pytest.fixture(name='find')
def fixture_find(tmp_path):
    write_binary_stl(tmp_path / 'a.stl', CUBE_CORNERS, CUBE_TRIANGLES)
    return finder(tmp_path)


def test_the_corners_of_collision_meshes_stand_in_for_their_files(find):
    hull, ball = ElementTree.fromstring(self_contained_urdf(URDF, 'my.urdf', find)).find('link').findall('collision')
    assert hull.get('name') == 'hull'
    kind, name, numbers = hull.find('geometry/mesh').get('filename').split(':')
    assert (kind, name) == ('corners', 'a.stl')
    corners = np.array(numbers.split(), float).reshape(-1, 3)
    assert sorted(corners.tolist()) == sorted(CUBE_CORNERS.tolist())
    assert hull.find('geometry/mesh').get('scale') == '0.1 0.2 0.3'
    assert ball.find('geometry/sphere').get('radius') == '0.5'


def test_it_needs_no_other_file_afterwards(find):
    text = self_contained_urdf(URDF, 'my.urdf', find)
    assert self_contained_urdf(text, 'my.urdf', no_file) == text


def test_read_again_it_has_the_shapes_and_the_notes_that_the_files_give(find):
    before = parse_urdf(URDF, 'my.urdf')
    after = parse_urdf(self_contained_urdf(URDF, 'my.urdf', find), 'my.urdf')
    for name, link in before.links.items():
        right, found = primitives_of(link, 'my.urdf', find), primitives_of(after.links[name], 'my.urdf', no_file)
        assert found.notes == right.notes
        assert [str(shape) for shape in found.shapes] == [str(shape) for shape in right.shapes]


def test_a_wheel_that_is_round_to_the_eye_only_keeps_its_visual_mesh(tmp_path, find):
    bearings_rad = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    rim = np.stack([np.cos(bearings_rad), np.sin(bearings_rad)], axis=1)
    drum = np.vstack([np.column_stack([rim[:, 0], np.full(12, y), rim[:, 1]]) for y in (-1, 1)])
    write_binary_stl(tmp_path / 'drum.stl', drum, np.arange(24).reshape(-1, 3))
    (tmp_path / 'torn.stl').write_bytes(b'')
    text = self_contained_urdf(WHEEL, 'my.urdf', find)
    meshes = [mesh.get('filename') for mesh in ElementTree.fromstring(text).iter('mesh')]
    assert [name.split(':')[0] for name in meshes] == ['corners', 'corners', 'package', 'package']
    (round_one,) = visual_primitives_of(parse_urdf(text, 'my.urdf').links['wheel'], no_file)
    assert isinstance(round_one.geometry, Cylinder)


@pytest.mark.parametrize(
    'text',
    [
        '<xacro:include filename="a.xacro"/>',
        '<property value="$(find my_robot)"/>',
        '<property value="$(env HOME)"/>',
        '<x value="${xacro.load_yaml(file)}"/>',
        '<mesh filename="a.stl"/>',
    ],
)
def test_includes_packages_environment_and_meshes_need_other_files(text):
    assert needs_other_files(f'<robot>{text}</robot>')


def test_a_robot_in_one_file_needs_no_other():
    assert not needs_other_files((ROOT / 'urdf' / 'alto.urdf.xacro').read_text())
    assert not needs_other_files('<robot><xacro:arg name="a" default="1"/><x y="$(arg a)"/></robot>')
