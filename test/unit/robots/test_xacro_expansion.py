"""xacros become URDF, wherever their packages are and whatever is wrong with them."""

import os
import subprocess
import sys

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots import xacro_expansion
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.package_search import SEARCH_VARIABLES
from diff_encoder_sim.robots.xacro_expansion import Expansion, expand, expansion
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


def test_the_text_does_not_depend_on_the_folder(tmp_path):
    one, two = (write(tmp_path / name / 'r.xacro', '<xacro:property name="x" value="1"/>') for name in 'ab')
    assert expand(RobotSource(one)) == expand(RobotSource(two))


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
    assert text.startswith(", line 2: package 'parts' is not found; looked for in ")
    for place in (str(tmp_path / 'mine'), str(tmp_path), 'ROS_PACKAGE_PATH (/ws/src)', 'AMENT_PREFIX_PATH (not set)'):
        assert place in text


@pytest.mark.parametrize(
    ('body', 'text'),
    [
        (
            '\n<a b="${2 * missing}"/>',
            ", line 2: name 'missing' is not defined when evaluating expression '2 * missing'",
        ),
        ('\n\n<xacro:missing/>', ', line 3: unknown macro name: xacro:missing'),
        ('\n<xacro:include filename="none.xacro"/>', ', line 2: No such file or directory: '),
        (
            '<xacro:macro name="m" params="p"/>\n<xacro:m p="1" q="2"/>',
            ', line 2: Invalid parameter "q" in macro "xacro:m"',
        ),
        ('\n<a b="$(env MISSING_VARIABLE)"/>', ", line 2: environment variable 'MISSING_VARIABLE' is not set"),
        ('\n<a b="${1 / 0}"/>', ', line 2: division by zero'),
        ('<a>', ', line 1: not well-formed XML: mismatched tag'),
        ('<a b="${xacro.load_yaml(\'none.yaml\')}"/>', 'No such file or directory'),
        ('<xacro:macro name="bot"><link name="a"/></xacro:macro>', 'no link: the file defines bot, but uses no macro'),
    ],
)
def test_a_fault_is_one_line_with_file_and_line(tmp_path, body, text):
    assert text in refused(RobotSource(write(tmp_path / 'r.xacro', body)))


def test_a_fault_in_an_included_file_names_both(tmp_path):
    write(tmp_path / 'part.xacro', '\n<a b="${missing}"/>')
    text = refused(RobotSource(write(tmp_path / 'r.xacro', '<xacro:include filename="part.xacro"/>')))
    assert text.startswith(f": {tmp_path / 'part.xacro'}, line 2: name 'missing' is not defined")


def test_arguments_that_do_not_fit_are_named(tmp_path):
    path = write(tmp_path / 'r.xacro', '<xacro:arg name="size" default="1"/>\n<a b="$(arg size)" c="$(arg colour)"/>')
    text = refused(RobotSource(path))
    assert text.startswith(", line 2: argument 'colour' has no value, and no <xacro:arg> with a default; others: size;")
    text = refused(RobotSource(path, (('colour', 'red'), ('sise', '2'))))
    assert text == ": argument 'sise' is not known; did you mean 'size'?; allowed: size, colour"
    plain = tmp_path / 'r.urdf'
    plain.write_text('<robot/>')
    assert refused(RobotSource(plain, (('size', '2'),))) == ": argument 'size' is not known; allowed: no argument"


@pytest.mark.parametrize(
    ('body', 'text'),
    [
        ('<xacro:include filename="r.xacro"/>', 'files include each other'),
        ('<xacro:macro name="m"><xacro:m/></xacro:macro><xacro:m/>', 'refer to each other without end'),
        ('<xacro:property name="x" value="${y}"/><xacro:property name="y" value="${x}"/><a b="${x}"/>', 'circular'),
        ('<a b="${\'x\' * 10**11}"/>', 'too much memory'),
        ('<a b="${len(\'x\' * 6 * 10**8)}"/>', 'too much memory'),
        ('<a>' * 2000 + '</a>' * 2000, 'too much XML'),
    ],
)
def test_what_does_not_end_is_ended(tmp_path, body, text):
    assert text in refused(RobotSource(write(tmp_path / 'r.xacro', body)))


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
        '<xacro:include filename="pa*.xacro"/><link name="${size}"/>',
        '<xacro:property name="all" value="${xacro.load_yaml(\'part.yaml\')}"/><link name="${all[\'size\']}"/>',
        '<link name="$(optenv ROBOT_SIZE none)"/>',
    ],
)
def test_what_a_robot_is_made_from_is_read_again_when_it_changes(tmp_path, monkeypatch, body):
    path = write(tmp_path / 'r.xacro', body)
    for size in ('small', 'large'):
        write(tmp_path / 'part.xacro', f'<xacro:property name="size" value="{size}"/>')
        (tmp_path / 'part.yaml').write_text(f'size: {size}')
        monkeypatch.setenv('ROBOT_SIZE', size)
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
