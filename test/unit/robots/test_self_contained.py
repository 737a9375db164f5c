from xml.etree import ElementTree

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.xml_values import joint_origin, rotation_from_rpy
from diff_encoder_sim.robots.mesh_hulls import primitives_of
from diff_encoder_sim.robots.self_contained import needs_other_files, self_contained_urdf
from diff_encoder_sim.robots.urdf_parsing import parse_urdf
from places import ROOT
from robot_parts import CUBE_CORNERS, CUBE_TRIANGLES, finder, write_binary_stl

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


@pytest.fixture(name='find')
def fixture_find(tmp_path):
    write_binary_stl(tmp_path / 'a.stl', CUBE_CORNERS, CUBE_TRIANGLES)
    return finder(tmp_path)


def test_collision_meshes_become_primitives_in_their_place(find):
    base, top = ElementTree.fromstring(self_contained_urdf(URDF, 'my.urdf', find)).findall('link')
    hull, ball = base.findall('collision')
    assert hull.get('name') == 'hull'
    assert hull.find('geometry/box').get('size') == '0.2 0.4 0.6'
    origin = joint_origin(hull)
    assert origin.xyz_m == (1, 2, 3)
    assert rotation_from_rpy(*origin.rpy_rad) == pytest.approx(rotation_from_rpy(0.1, 0.2, 0.3))
    assert ball.find('geometry/sphere').get('radius') == '0.5'
    assert top.find('collision/geometry/box').get('size') == '2.0 2.0 2.0'


def test_all_else_stays(find):
    robot = ElementTree.fromstring(self_contained_urdf(URDF, 'my.urdf', find))
    assert robot.find('link/visual/geometry/mesh').get('filename') == 'package://p/seen.dae'
    assert robot.find('gazebo/plugin/x').text == '1'


def test_it_needs_no_other_file_afterwards(find):
    text = self_contained_urdf(URDF, 'my.urdf', find)
    assert self_contained_urdf(text, 'my.urdf', lambda uri: None) == text


def test_read_again_it_has_the_shapes_that_the_meshes_were_replaced_by(find):
    before = parse_urdf(URDF, 'my.urdf')
    after = parse_urdf(self_contained_urdf(URDF, 'my.urdf', find), 'my.urdf')
    for name, link in before.links.items():
        for right, found in zip(primitives_of(link, 'my.urdf', find).shapes, after.links[name].collisions):
            assert found.geometry == right.geometry
            assert found.pose_in_link == pytest.approx(right.pose_in_link, abs=1e-12)


def test_a_urdf_without_collision_meshes_stays_as_it_is():
    text = '<robot name="made"><link name="base"/></robot>  <!-- end -->\n'
    assert self_contained_urdf(text, 'my.urdf', lambda uri: None) is text


def test_a_missing_mesh_is_one_line_that_names_file_link_and_mesh():
    message = "my.urdf: link 'base': collision mesh 'package://p/a.stl': given a file that is missing"
    with pytest.raises(ConfigError) as caught:
        self_contained_urdf(URDF, 'my.urdf', lambda uri: None)
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize('scale', ['1 1', 'x y z', '1 1 nan'])
def test_a_scale_that_is_no_three_numbers_is_one_line(find, scale):
    with pytest.raises(ConfigError, match="^my.urdf: link 'base': collision: mesh scale: given"):
        self_contained_urdf(URDF.replace('0.1 0.2 0.3"/></g', f'{scale}"/></g'), 'my.urdf', find)


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


def test_numbers_keep_all_their_digits(find):
    text = self_contained_urdf(URDF.replace('0.1 0.2 0.3"/></g', '0.1234565 1 1"/></g'), 'my.urdf', find)
    size = ElementTree.fromstring(text).find('link/collision/geometry/box').get('size')
    assert np.fromstring(size, sep=' ')[0] == pytest.approx(0.246913, abs=1e-9)
