"""xacros become URDF, whatever is wrong with them; packages and meshes are found as ROS would, and without it."""

import os
import subprocess
import sys
from xml.etree import ElementTree

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots import xacro_expansion
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.xacro_expansion import expansion, find_mesh, find_package, xacro_arguments_of_text
from diff_encoder_sim.simulation.link_frames import display_urdf
from diff_encoder_sim.trials.trial_files import needs_other_files
from places import ROOT
from urdf_texts import joint, link

ALTO = RobotSource(ROOT / 'urdf' / 'alto.urdf.xacro')
HEAD = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">'


@pytest.fixture(autouse=True)
def no_ros(monkeypatch):
    for variable in xacro_expansion.SEARCH_VARIABLES:
        monkeypatch.delenv(variable, raising=False)


def write(path, body):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f'{HEAD}{body}</robot>')
    return path


def complaint_about(path, *arguments):
    with pytest.raises(ConfigError) as caught:
        expansion(RobotSource(path, *arguments))
    text = str(caught.value)
    assert '\n' not in text and text.startswith(str(path))
    return text[len(str(path)) :]


def test_packages_are_found_without_ros_and_the_text_does_not_depend_on_the_folder(tmp_path):
    write(tmp_path / 'parts' / 'urdf' / 'a.xacro', '<xacro:include filename="b.xacro"/><link name="a"/>')
    write(tmp_path / 'parts' / 'urdf' / 'b.xacro', '<xacro:property name="name" value="$(find parts)/b"/>')
    include = '<xacro:include filename="$(find parts)/urdf/a.xacro"/>'
    body = include + '<link name="${name}"/><mesh filename="package://parts/x.stl"/>'
    parts = (tmp_path / 'parts',)
    one, two = (expansion(RobotSource(write(tmp_path / name / 'r.urdf', body), (), parts)).urdf for name in 'ab')
    assert one == two
    for part in (f'<link name="{tmp_path}/parts/b"/>', '<link name="a"/>', 'package://parts/x.stl'):
        assert part in one


def test_a_package_that_nothing_is_read_from_may_be_missing(tmp_path):
    result = expansion(RobotSource(write(tmp_path / 'r.xacro', '<plugin filename="$(find drivers)/lib.so"/>')))
    assert '<plugin filename="package://drivers/lib.so"/>' in result.urdf
    assert "package 'drivers' is not found" in ' '.join(result.notes)


@pytest.mark.parametrize(
    'body',
    [
        '\n<xacro:property name="p" value="$(find parts)"/><xacro:include filename="${p}/a.xacro"/>',
        '\n<xacro:property name="p" value="${xacro.load_yaml(\'$(find parts)/a.yaml\')}"/><a b="${p}"/>',
    ],
)
def test_a_package_that_is_read_from_and_missing_is_named_with_where_it_was_looked_for(tmp_path, monkeypatch, body):
    monkeypatch.setenv('ROS_PACKAGE_PATH', '/ws/src')
    text = complaint_about(write(tmp_path / 'r.xacro', body), (), (tmp_path / 'mine',))
    assert "package 'parts' is not found; looked for in " in text
    for place in (str(tmp_path / 'mine'), str(tmp_path), 'ROS_PACKAGE_PATH (/ws/src)', 'AMENT_PREFIX_PATH (not set)'):
        assert place in text


@pytest.mark.parametrize(
    ('body', 'text'),
    [
        ('<a b="${2 * missing}"/>', "name 'missing' is not defined"),
        ('<xacro:missing/>', 'xacro:missing'),
        ('<xacro:include filename="none.xacro"/>', 'none.xacro'),
        ('<xacro:include filename="part.xacro"/>', '{folder}/part.xacro: '),
        ('<a b="$(arg colour)"/>', 'colour'),
        ('<a>', 'mismatched tag'),
        ('<xacro:include filename="r.xacro"/>', 'recursion'),
    ],
)
def test_an_error_of_xacro_is_one_line_that_names_the_file(tmp_path, body, text):
    write(tmp_path / 'part.xacro', '<a b="${missing}"/>')
    assert text.format(folder=tmp_path) in complaint_about(write(tmp_path / 'r.xacro', body))


def test_unknown_arguments_are_named_with_those_that_are_known(tmp_path):
    path = write(tmp_path / 'r.xacro', '<xacro:arg name="size" default="1"/><a b="$(arg size)"/>')
    assert complaint_about(path, (('sise', '2'),)).endswith("known; did you mean 'size'?; allowed: size")
    (tmp_path / 'r.urdf').write_text('<robot/>')
    assert complaint_about(tmp_path / 'r.urdf', (('size', '2'),)).endswith('allowed: no argument')


def test_warnings_of_xacro_are_notes_and_not_on_the_terminal(tmp_path, capfd):
    path = write(tmp_path / 'r.xacro', '<xacro:property name="pi" value="3"/><a b="${xacro.warning(\'careful\')}"/>')
    assert 'careful' in ' '.join(expansion(RobotSource(path)).notes)
    assert capfd.readouterr() == ('', '')


def test_what_a_robot_is_made_from_is_read_again_when_it_changes(tmp_path):
    body = '<xacro:include filename="part.xacro" optional="true"/><link name="${xacro.load_yaml(\'p.yaml\')[size]}"/>'
    path = write(tmp_path / 'r.xacro', body)
    for size, text in (('s', 'small'), ('s', 'tiny'), ('l', 'large')):
        write(tmp_path / 'part.xacro', f'<xacro:property name="size" value="{size}"/>')
        (tmp_path / 'p.yaml').write_text(f'{{s: {text}, l: large}}')
        assert f'<link name="{text}"/>' in expansion(RobotSource(path)).urdf


def test_a_robot_is_expanded_once_for_many_trials(monkeypatch):
    first = expansion(ALTO).urdf
    monkeypatch.setattr(xacro_expansion.subprocess, 'run', None)
    assert expansion(ALTO).urdf is first


def test_limits_of_the_job_that_starts_it_may_be_lower(tmp_path):
    """As on a cluster, or after ulimit -v and ulimit -t."""
    code = (
        'from diff_encoder_sim.robots.xacro_expansion import *; import resource, sys\n'
        'resource.setrlimit(resource.RLIMIT_CPU, (5, 5)); resource.setrlimit(resource.RLIMIT_AS, (4 * 10**8,) * 2)\n'
        'print(expansion(RobotSource(Path(sys.argv[1]))).urdf)'
    )
    command = [sys.executable, '-c', code, str(write(tmp_path / 'r.xacro', '<link name="${1 + 1}"/>'))]
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert '<link name="2"/>' in done.stdout, done.stderr


def test_words_and_texts_give_the_same():
    expected = {'scale': '2', 'name': 'my robot', 'empty': ''}
    assert xacro_expansion.xacro_arguments(['scale:=2', 'name:=my robot', 'empty:=']) == expected
    for text in ("scale:=2 name:='my robot' empty:=", "scale=2 name='my robot' empty="):
        assert xacro_arguments_of_text(text) == expected
    for text in (':=2', "a:='1"):
        with pytest.raises(ConfigError, match='robot_args: '):
            xacro_arguments_of_text(text)


WHEELS = ('left_wheel_joint', 'right_wheel_joint')
MAST = link('mast') + joint('lift', 'mast', '0 0 1', 'prismatic', inside='<limit lower="0" upper="1"/>')


def test_for_display_joints_without_a_state_are_fixed_and_the_root_link_has_no_inertia(tmp_path):
    """robot_state_publisher would warn of that."""
    path = tmp_path / 'robot.urdf'
    path.write_text(expansion(ALTO).urdf.replace('</robot>', f'{MAST}</robot>'))
    robot = ElementTree.fromstring(display_urdf(RobotSource(path), WHEELS))
    kinds = {each.get('name'): each.get('type') for each in robot.findall('joint')}
    assert kinds['lift'] == 'fixed'
    assert {kinds[name] for name in WHEELS} == {'continuous'}
    assert robot.find("link[@name='base_link']/inertial") is None
    # A robot with an argument for it stays as its author wrote it.
    assert display_urdf(ALTO, WHEELS) == expansion(ALTO._replace(arguments=(('root_inertia', 'false'),))).urdf


@pytest.mark.parametrize(
    ('text', 'needs'),
    [
        ('<xacro:include filename="a.xacro"/>', True),
        ('<property value="$(find my_robot)"/>', True),
        ('<property value="$(env HOME)"/>', True),
        ('<x value="${xacro.load_yaml(file)}"/>', True),
        ('<mesh filename="a.stl"/>', True),
        ('<xacro:arg name="a" default="1"/><x y="$(arg a)"/>', False),
        (ALTO.file.read_text(), False),
    ],
)
def test_includes_packages_environment_and_meshes_need_other_files(text, needs):
    assert needs_other_files(f'<robot>{text}</robot>') == needs


def package(folder, name='', inside='meshes/wheel.stl'):
    """A package in a folder; without a package.xml when `name` is None."""
    (folder / inside).parent.mkdir(parents=True)
    (folder / inside).write_text('mesh')
    if name is not None:
        (folder / 'package.xml').write_text(f'<package format="2">\n <name> {name or folder.name} </name></package>')
    return folder


def robot_in(folder, *package_folders):
    return RobotSource(folder / 'urdf' / 'robot.urdf', (), package_folders)


@pytest.mark.parametrize(
    ('name', 'place', 'declared', 'is_found'),
    [
        # The robot's own package has the name of its package.xml, or its folder's.
        ('foo_description', 'src/robots/own', 'foo_description', True),
        ('own', 'src/robots/own', None, True),
        ('own', 'src/robots/own', 'foo_description', True),
        ('foo', 'src/robots/own', 'foo_description', False),
        # Its neighbours
        ('foo_gazebo', 'src/robots/foo_gazebo-1.0', 'foo_gazebo', True),
        ('lasers', 'src/sensors/lasers', '', True),
        # Folders that are named are packages or hold some levels down.
        ('lone', 'a/b/lone', '', True),
        ('deep', 'named/src/repo/deep_folder', 'deep', True),
        ('bare', 'named/bare', None, True),
        ('hidden', 'named/.git/hidden', '', False),
        ('unused', 'named/ignored/unused', '', False),
        # ROS 1 and ROS 2
        ('one', 'ros/stack/one', '', True),
        ('two', 'ros/share/two', '', True),
    ],
)
def test_where_packages_are_found(tmp_path, monkeypatch, name, place, declared, is_found):
    monkeypatch.setenv('ROS_PACKAGE_PATH', f'/nowhere:{tmp_path}/ros/stack')
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'/nowhere:{tmp_path}/ros')
    if place != 'src/robots/own':
        package(tmp_path / 'src' / 'robots' / 'own')
    (tmp_path / 'named' / 'ignored').mkdir(parents=True)
    (tmp_path / 'named' / 'ignored' / 'CATKIN_IGNORE').touch()
    folder = package(tmp_path / place, declared)
    source = robot_in(tmp_path / 'src' / 'robots' / 'own', *(tmp_path / name for name in ('a/b/lone', 'named', 'none')))
    assert find_package(name, source) == (folder if is_found else None)


def test_the_robots_own_package_comes_first_then_named_folders_and_ros_last(tmp_path, monkeypatch):
    own, ros, named = (package(tmp_path / name / 'foo') for name in ('near', 'ros', 'named'))
    monkeypatch.setenv('ROS_PACKAGE_PATH', str(tmp_path / 'ros'))
    assert find_package('foo', robot_in(own, tmp_path / 'named')) == own
    assert find_package('foo', robot_in(tmp_path / 'elsewhere', tmp_path / 'named')) == named
    assert find_package('foo', robot_in(tmp_path / 'elsewhere')) == ros


@pytest.mark.parametrize(
    'uri',
    [
        'package://foo/meshes/a wheel.stl',
        'model://foo/meshes/a wheel.stl',
        'file://{mesh}',
        'file://{quoted}',
        '../meshes/a wheel.stl',
        '{mesh}',
    ],
)
def test_meshes_are_named_in_many_ways(tmp_path, uri):
    own = package(tmp_path / 'foo', inside='meshes/a wheel.stl')
    (own / 'urdf').mkdir()
    mesh = own / 'meshes' / 'a wheel.stl'
    assert find_mesh(uri.format(mesh=mesh, quoted=str(mesh).replace(' ', '%20')), robot_in(own)).samefile(mesh)


@pytest.mark.parametrize(
    ('uri', 'shown'),
    [
        ('package://foo/meshes/none.stl', "package 'foo' in {own} has no file 'meshes/none.stl'"),
        ('file://package://nowhere/a.stl', "package 'nowhere' is not found; looked for in "),
        ('none.stl', 'there is no file {own}/urdf/none.stl; allowed: '),
    ],
)
def test_an_error_shows_whether_the_file_or_its_package_is_missing(tmp_path, uri, shown):
    own = package(tmp_path / 'foo')
    with pytest.raises(ConfigError) as caught:
        find_mesh(uri, robot_in(own))
    assert str(caught.value).startswith(shown.format(own=own))


def test_a_description_that_was_copied_without_its_package_finds_its_meshes(tmp_path):
    copied = package(tmp_path / 'downloads', None)
    assert find_mesh('package://foo/meshes/wheel.stl', robot_in(copied)) == copied / 'meshes' / 'wheel.stl'
