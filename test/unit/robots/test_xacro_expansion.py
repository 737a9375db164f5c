"""xacros become URDF, wherever their packages are and whatever is wrong with them."""

import os
import subprocess
import sys
from xml.etree import ElementTree

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots import xacro_expansion
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.package_search import SEARCH_VARIABLES
from diff_encoder_sim.robots.xacro_expansion import (
    Expansion,
    display_urdf,
    expand,
    expansion,
    xacro_arguments,
    xacro_arguments_of_text,
)
from places import ROOT

ALTO = ROOT / 'urdf' / 'alto.urdf.xacro'
HEAD = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'


@pytest.fixture(autouse=True)
def no_ros(monkeypatch):
    for variable in SEARCH_VARIABLES:
        monkeypatch.delenv(variable, raising=False)


def write(path, body):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f'{HEAD}{body}</robot>')
    return path


def refused(source):
    with pytest.raises(ConfigError) as caught:
        expand(source)
    text = str(caught.value)
    assert '\n' not in text and text.startswith(str(source.file))
    return text[len(str(source.file)) :]


def test_arguments_change_the_robot_and_are_listed():
    urdf = expand(RobotSource(ALTO, (('wheel_radius_error_left', '0.5'),)))
    assert '<sphere radius="0.15"/>' in urdf.replace('0.15000000000000002', '0.15')
    assert 'lidar_noise' in expansion(RobotSource(ALTO)).declared


def test_a_plain_urdf_is_taken_as_it_is(tmp_path):
    path = tmp_path / 'r.urdf'
    path.write_text('\n<?xml version="1.0"?>\n<robot name="r"><link name="a"/></robot>')
    assert expansion(RobotSource(path)) == Expansion('\n\n<robot name="r"><link name="a"/></robot>')


def test_packages_are_found_without_ros(tmp_path):
    write(tmp_path / 'parts' / 'urdf' / 'a.xacro', '<xacro:include filename="b.xacro"/><link name="a"/>')
    write(tmp_path / 'parts' / 'urdf' / 'b.xacro', '<xacro:property name="name" value="$(find parts)/b"/>')
    robot = write(
        tmp_path / 'r' / 'r.urdf',
        '<xacro:include filename="$(find parts)/urdf/a.xacro"/><link name="${name}"/>'
        '<mesh filename="package://parts/x.stl"/>',
    )
    urdf = expand(RobotSource(robot, (), (tmp_path / 'parts',)))
    assert f'<link name="{tmp_path}/parts/b"/>' in urdf and '<link name="a"/>' in urdf
    assert 'package://parts/x.stl' in urdf


def test_a_package_that_nothing_is_read_from_may_be_missing(tmp_path):
    path = write(tmp_path / 'r.xacro', '<plugin filename="$(find drivers)/lib.so"/>')
    result = expansion(RobotSource(path))
    assert '<plugin filename="package://drivers/lib.so"/>' in result.urdf
    assert "package 'drivers' is not found" in ' '.join(result.notes)


@pytest.mark.parametrize(
    'body',
    [
        '\n<xacro:include filename="$(find parts)/a.xacro"/>',
        '\n<xacro:property name="p" value="$(find parts)"/><xacro:include filename="${p}/a.xacro"/>',
        '\n<xacro:property name="p" value="${xacro.load_yaml(\'$(find parts)/a.yaml\')}"/><a b="${p}"/>',
    ],
)
def test_a_package_that_is_read_from_and_missing_is_named_with_where_it_was_looked_for(tmp_path, monkeypatch, body):
    monkeypatch.setenv('ROS_PACKAGE_PATH', '/ws/src')
    text = refused(RobotSource(write(tmp_path / 'r.xacro', body), (), (tmp_path / 'mine',)))
    assert "package 'parts' is not found; looked for in " in text
    for place in (str(tmp_path / 'mine'), str(tmp_path), 'ROS_PACKAGE_PATH (/ws/src)', 'AMENT_PREFIX_PATH (not set)'):
        assert place in text


@pytest.mark.parametrize(
    ('body', 'text'),
    [
        ('<a b="${2 * missing}"/>', "name 'missing' is not defined"),
        ('<xacro:missing/>', 'xacro:missing'),
        ('<xacro:include filename="none.xacro"/>', 'none.xacro'),
        ('<a b="$(env MISSING_VARIABLE)"/>', 'MISSING_VARIABLE'),
        ('<a b="$(arg colour)"/>', 'colour'),
        ('<a>', 'mismatched tag'),
        ('<xacro:include filename="r.xacro"/>', 'recursion'),
        ('<xacro:property name="x" value="${y}"/><xacro:property name="y" value="${x}"/><a b="${x}"/>', 'circular'),
    ],
)
def test_an_error_of_xacro_is_one_line_that_names_the_file(tmp_path, body, text):
    assert text in refused(RobotSource(write(tmp_path / 'r.xacro', body)))


def test_an_error_in_an_included_file_names_both(tmp_path):
    write(tmp_path / 'part.xacro', '<a b="${missing}"/>')
    text = refused(RobotSource(write(tmp_path / 'r.xacro', '<xacro:include filename="part.xacro"/>')))
    assert text.startswith(f': {tmp_path / "part.xacro"}: ')


def test_unknown_arguments_are_named_with_those_that_are_known(tmp_path):
    path = write(tmp_path / 'r.xacro', '<xacro:arg name="size" default="1"/><a b="$(arg size)"/>')
    text = refused(RobotSource(path, (('sise', '2'),)))
    assert text == ": argument 'sise' is not known; did you mean 'size'?; allowed: size"
    plain = tmp_path / 'r.urdf'
    plain.write_text('<robot/>')
    assert refused(RobotSource(plain, (('size', '2'),))) == ": argument 'size' is not known; allowed: no argument"


def test_an_expansion_that_takes_too_long_is_stopped(tmp_path, monkeypatch):
    monkeypatch.setattr(xacro_expansion, 'MOST_S', 1)
    path = write(tmp_path / 'r.xacro', '<a b="${10**10**10}"/>')
    assert refused(RobotSource(path)) == ': takes longer than 1 s to expand'


def test_warnings_of_xacro_are_notes_and_not_on_the_terminal(tmp_path, capfd):
    path = write(tmp_path / 'r.xacro', '<xacro:property name="pi" value="3"/><a b="${xacro.warning(\'careful\')}"/>')
    assert 'careful' in ' '.join(expansion(RobotSource(path)).notes)
    assert capfd.readouterr() == ('', '')


@pytest.mark.parametrize(
    'body',
    [
        '<xacro:include filename="part.xacro"/><link name="${size}"/>',
        '<xacro:property name="all" value="${xacro.load_yaml(\'part.yaml\')}"/><link name="${all[\'size\']}"/>',
    ],
)
def test_what_a_robot_is_made_from_is_read_again_when_it_changes(tmp_path, body):
    path = write(tmp_path / 'r.xacro', body)
    for size in ('small', 'large'):
        write(tmp_path / 'part.xacro', f'<xacro:property name="size" value="{size}"/>')
        (tmp_path / 'part.yaml').write_text(f'size: {size}')
        assert f'<link name="{size}"/>' in expand(RobotSource(path))


def test_an_optional_file_that_comes_later_is_read_then(tmp_path):
    path = write(tmp_path / 'r.xacro', '<xacro:include filename="part.xacro" optional="true"/>')
    assert 'link' not in expand(RobotSource(path))
    write(tmp_path / 'part.xacro', '<link name="a"/>')
    assert '<link name="a"/>' in expand(RobotSource(path))


def test_a_robot_is_expanded_once_for_many_trials(monkeypatch):
    first = expand(RobotSource(ALTO))
    monkeypatch.setattr(xacro_expansion.subprocess, 'run', None)
    assert expand(RobotSource(ALTO)) is first


def test_limits_of_whoever_starts_it_may_be_lower(tmp_path):
    """As in a job of a cluster, or after ulimit -v and ulimit -t."""
    path = tmp_path / 'r.xacro'
    path.write_text(f'{HEAD}<link name="${{1 + 1}}"/></robot>')
    code = (
        'import resource, sys; from pathlib import Path\n'
        'from diff_encoder_sim.robots.description import RobotSource\n'
        'from diff_encoder_sim.robots.xacro_expansion import expand\n'
        'resource.setrlimit(resource.RLIMIT_CPU, (5, 5)); resource.setrlimit(resource.RLIMIT_AS, (4 * 10**8,) * 2)\n'
        'print(expand(RobotSource(Path(sys.argv[1]))))'
    )
    done = subprocess.run(
        [sys.executable, '-c', code, path],
        capture_output=True,
        text=True,
        env={**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)},
        check=False,
    )
    assert '<link name="2"/>' in done.stdout, done.stderr


def test_words_and_texts_give_the_same():
    expected = {'scale': '2', 'name': 'my robot', 'empty': ''}
    assert xacro_arguments(['scale:=2', 'name:=my robot', 'empty:=']) == expected
    assert xacro_arguments_of_text("scale:=2 name:='my robot' empty:=") == expected
    assert xacro_arguments_of_text("scale=2 name='my robot' empty=") == expected
    assert xacro_arguments_of_text('') == {}


@pytest.mark.parametrize(
    ('text', 'expected'),
    [
        ('scale', "robot_args: given 'scale'; allowed: name:=value"),
        (':=2', "given ':=2'"),
        ('a:=1 a:=2', "given 'a' twice; allowed: once"),
        ("a:='1", 'No closing quotation'),
    ],
)
def test_mistakes_are_named(text, expected):
    with pytest.raises(ConfigError) as error:
        xacro_arguments_of_text(text)
    assert expected in str(error.value)


WHEELS = ('left_wheel_joint', 'right_wheel_joint')
ALTO_DISPLAY_URDF = RobotSource(ROOT / 'urdf' / 'alto.urdf.xacro')


def kinds(urdf):
    return {joint.get('name'): joint.get('type') for joint in ElementTree.fromstring(urdf).findall('joint')}


def robot(tmp_path, more):
    path = tmp_path / 'robot.urdf'
    path.write_text(expand(ALTO_DISPLAY_URDF).replace('</robot>', f'{more}</robot>'))
    return RobotSource(path)


def test_a_joint_without_a_state_is_fixed(tmp_path):
    mast = (
        '<link name="mast"/><joint name="lift" type="prismatic"><parent link="base_link"/><child link="mast"/>'
        '<limit lower="0" upper="1" effort="1" velocity="1"/></joint>'
    )
    found = kinds(display_urdf(robot(tmp_path, mast), WHEELS))
    assert found['lift'] == 'fixed'
    assert {found[name] for name in WHEELS} == {'continuous'}


def test_the_root_link_has_no_inertia(tmp_path):
    """robot_state_publisher would warn of it."""
    urdf = display_urdf(robot(tmp_path, ''), WHEELS)
    (root,) = [link for link in ElementTree.fromstring(urdf).findall('link') if link.get('name') == 'base_link']
    assert root.find('inertial') is None


def test_a_robot_with_an_argument_for_it_stays_as_its_author_wrote_it():
    with_argument = ALTO_DISPLAY_URDF._replace(arguments=(('root_inertia', 'false'),))
    assert display_urdf(ALTO_DISPLAY_URDF, WHEELS) == expand(with_argument)


def test_the_text_does_not_depend_on_the_folder(tmp_path):
    one, two = (write(tmp_path / name / 'r.xacro', '<xacro:property name="x" value="1"/>') for name in 'ab')
    assert expand(RobotSource(one)) == expand(RobotSource(two))
