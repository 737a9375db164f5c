"""The robot file: what the physics and the controller take from it."""

import shutil
import subprocess
from xml.etree import ElementTree

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.typed_params import load_yaml
from diff_encoder_sim.simulation.robot import expand_xacro, load_robot
from places import ROOT

ALTO = ROOT / 'urdf' / 'alto.urdf.xacro'
WHEELS = ('left_wheel_joint', 'right_wheel_joint')

SMALL = """<robot name="small"><link name="base_link"/>
  <link name="axle"/><link name="l"><collision><geometry><sphere radius="0.05"/></geometry>
  </collision></link><link name="r"><collision><geometry><cylinder radius="0.06" length="0.01"/>
  </geometry></collision></link>
  <joint name="a" type="fixed"><parent link="base_link"/><child link="axle"/>
    <origin xyz="0.1 0 0" rpy="0 0 1.5707963267948966"/></joint>
  <joint name="jl" type="continuous"><parent link="axle"/><child link="l"/>
    <origin xyz="0.2 0 0"/></joint>
  <joint name="jr" type="continuous"><parent link="axle"/><child link="r"/>
    <origin xyz="-0.2 0 0"/></joint></robot>"""


def test_alto_is_table_1_of_the_paper():
    alto = load_robot(ALTO, *WHEELS, {})
    assert alto.name == 'alto'
    assert (alto.left_wheel_radius_m, alto.right_wheel_radius_m) == (0.1, 0.1)
    assert alto.wheel_separation_m == pytest.approx(0.4)
    masses = [float(mass.get('value')) for mass in ElementTree.fromstring(alto.urdf).iter('mass')]
    assert sum(masses) == pytest.approx(80.0)


def test_the_odometry_has_the_geometry_of_the_robot_file():
    config, alto = load_yaml(ROOT / 'config' / 'config.yaml'), load_robot(ALTO, *WHEELS, {})
    assert config['wheel_diameter'] == pytest.approx(2 * alto.left_wheel_radius_m)
    assert config['wheel_separation'] == pytest.approx(alto.wheel_separation_m)


def test_errors_of_the_true_geometry_are_arguments():
    alto = load_robot(
        ALTO,
        *WHEELS,
        {'wheel_radius_error_left': '0.01', 'wheel_radius_error_right': '-0.02', 'wheel_separation_error': '0.05'},
    )
    assert alto.left_wheel_radius_m == pytest.approx(0.101)
    assert alto.right_wheel_radius_m == pytest.approx(0.098)
    assert alto.wheel_separation_m == pytest.approx(0.42)


def test_a_plain_urdf_with_turned_frames_between_base_and_wheels(tmp_path):
    path = tmp_path / 'small.urdf'
    path.write_text(SMALL)
    robot = load_robot(path, 'jl', 'jr', {})
    assert robot.wheel_separation_m == pytest.approx(0.4)
    assert (robot.left_wheel_radius_m, robot.right_wheel_radius_m) == (0.05, 0.06)
    turned = [[0, -1, 0, 0.1], [1, 0, 0, 0.2], [0, 0, 1, 0], [0, 0, 0, 1]]
    assert robot.link_pose_in_root('l') == pytest.approx(np.array(turned), abs=1e-15)
    assert (robot.link_pose_in_root('base_link') == np.eye(4)).all()
    with pytest.raises(ConfigError, match="link 'laser' is missing; it has base_link, axle, l, r"):
        robot.link_pose_in_root('laser')


@pytest.mark.parametrize(
    ('change', 'joints', 'complaint'),
    [
        (('', ''), ('jx', 'jr'), "joint 'jx' is missing; the file has a, jl, jr"),
        (('', ''), ('jr', 'jl'), 'the left wheel left of the right'),
        (('<sphere radius="0.05"/>', '<box size="1 1 1"/>'), ('jl', 'jr'), "wheel 'l' has no rolling"),
        (('<parent link="base_link"/>', '<parent link="l"/>'), ('jl', 'jr'), 'form a loop'),
        (('</robot>', ''), ('jl', 'jr'), 'not a valid xacro or URDF'),
        (('robot', 'sdf'), ('jl', 'jr'), 'given <sdf>; allowed: <robot>'),
    ],
)
def test_an_unsuitable_robot_is_refused_by_name(tmp_path, change, joints, complaint):
    path = tmp_path / 'robot.urdf'
    path.write_text(SMALL.replace(*change))
    with pytest.raises(ConfigError, match=complaint) as caught:
        load_robot(path, *joints, {})
    assert str(caught.value).startswith(f'{path}: ')
    assert '\n' not in str(caught.value)


def test_a_missing_file_is_refused():
    with pytest.raises(ConfigError, match='no such robot file'):
        expand_xacro('/nowhere/robot.xacro', {})


def test_a_robot_file_that_was_edited_is_read_again(tmp_path):
    path = tmp_path / 'small.urdf'
    for radius in ('0.05', '0.07', '0.05'):
        path.write_text(SMALL.replace('sphere radius="0.05"', f'sphere radius="{radius}"'))
        assert load_robot(path, 'jl', 'jr', {}).left_wheel_radius_m == float(radius)


@pytest.mark.parametrize(
    'body',
    [
        '<xacro:include filename="{folder}/size.xacro"/><link name="${{size}}"/>',
        (
            '<xacro:property name="sizes" value="${{xacro.load_yaml(\'{folder}/size.yaml\')}}"/>'
            '<link name="${{sizes[\'size\']}}"/>'
        ),
        '<link name="$(optenv ROBOT_SIZE none)"/>',
    ],
)
def test_what_a_robot_file_draws_on_is_read_again(tmp_path, monkeypatch, body):
    path = tmp_path / 'robot.xacro'
    path.write_text(
        '<robot name="r" xmlns:xacro="http://ros.org/wiki/xacro">' + body.format(folder=tmp_path) + '</robot>'
    )
    for size in ('small', 'large'):
        (tmp_path / 'size.xacro').write_text(
            f'<robot xmlns:xacro="http://ros.org/wiki/xacro"><xacro:property name="size" value="{size}"/></robot>'
        )
        (tmp_path / 'size.yaml').write_text(f'size: {size}')
        monkeypatch.setenv('ROBOT_SIZE', size)
        assert f'<link name="{size}"/>' in expand_xacro(path, {})


@pytest.mark.parametrize('root_inertia', ['true', 'false'])
@pytest.mark.skipif(shutil.which('check_urdf') is None, reason='check_urdf is not installed')
def test_check_urdf_passes(tmp_path, root_inertia):
    path = tmp_path / 'alto.urdf'
    path.write_text(expand_xacro(ALTO, {'root_inertia': root_inertia}))
    result = subprocess.run(['check_urdf', str(path)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    assert result.returncode == 0 and 'Successfully Parsed' in result.stdout, result.stdout
