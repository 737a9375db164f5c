"""Packages and meshes are found as ROS would, and without it."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.xacro_expansion import SEARCH_VARIABLES, find_mesh, find_package


@pytest.fixture(autouse=True)
def no_ros(monkeypatch):
    for variable in SEARCH_VARIABLES:
        monkeypatch.delenv(variable, raising=False)


def package(folder, name='', inside='meshes/wheel.stl'):
    """A package in a folder; without a package.xml when `name` is None."""
    (folder / inside).parent.mkdir(parents=True)
    (folder / inside).write_text('mesh')
    if name is not None:
        (folder / 'package.xml').write_text(f'<package format="2">\n <name> {name or folder.name} </name></package>')
    return folder


def robot_in(folder, *package_folders):
    return RobotSource(folder / 'urdf' / 'robot.urdf', (), package_folders)


def test_a_robots_own_package_has_the_name_of_its_package_xml(tmp_path):
    own = package(tmp_path / 'foo_description-master', 'foo_description')
    assert find_package('foo_description', robot_in(own)) == own
    assert find_package('foo', robot_in(own)) is None
    assert find_mesh('package://foo_description/meshes/wheel.stl', robot_in(own)) == own / 'meshes' / 'wheel.stl'


def test_neighbours_of_a_robots_package_are_found(tmp_path):
    own = package(tmp_path / 'src' / 'robots' / 'foo_description')
    beside = package(tmp_path / 'src' / 'robots' / 'foo_gazebo-1.0', 'foo_gazebo')
    elsewhere = package(tmp_path / 'src' / 'sensors' / 'lasers')
    assert find_package('foo_gazebo', robot_in(own)) == beside
    assert find_package('lasers', robot_in(own)) == elsewhere


@pytest.mark.parametrize('declared', [None, 'foo_descriptions'])
def test_a_package_goes_by_its_folders_name_too(tmp_path, declared):
    own = package(tmp_path / 'foo_description', declared)
    assert find_package('foo_description', robot_in(own)) == own
    assert find_package('foo_description', robot_in(tmp_path / 'x', tmp_path)) == own


def test_named_folders_are_packages_or_hold_some_levels_down(tmp_path):
    lone = package(tmp_path / 'a' / 'lone')
    deep = package(tmp_path / 'b' / 'src' / 'repo' / 'deep_folder', 'deep')
    package(tmp_path / 'b' / '.git' / 'hidden')
    package(tmp_path / 'b' / 'ignored' / 'unused')
    (tmp_path / 'b' / 'ignored' / 'CATKIN_IGNORE').touch()
    source = robot_in(tmp_path / 'c', lone, tmp_path / 'b', tmp_path / 'none')
    assert [find_package(name, source) for name in ('lone', 'deep', 'hidden', 'unused')] == [lone, deep, None, None]


@pytest.mark.parametrize(('variable', 'place'), [('ROS_PACKAGE_PATH', 'stack/foo'), ('AMENT_PREFIX_PATH', 'share/foo')])
def test_packages_of_ros_are_found(tmp_path, monkeypatch, variable, place):
    installed = package(tmp_path / 'ros' / place)
    monkeypatch.setenv(variable, f'/nowhere:{tmp_path / "ros"}')
    assert find_package('foo', RobotSource(tmp_path / 'r.urdf')) == installed


def test_the_robots_own_package_comes_first_then_named_folders_and_ros_last(tmp_path, monkeypatch):
    own, ros, named = (package(tmp_path / name / 'foo') for name in ('near', 'ros', 'named'))
    monkeypatch.setenv('ROS_PACKAGE_PATH', str(tmp_path / 'ros'))
    assert find_package('foo', robot_in(own, tmp_path / 'named')) == own
    assert find_package('foo', robot_in(tmp_path / 'elsewhere', tmp_path / 'named')) == named
    assert find_package('foo', robot_in(tmp_path / 'elsewhere')) == ros


def test_meshes_are_named_in_many_ways(tmp_path):
    own = package(tmp_path / 'foo', inside='meshes/a wheel.stl')
    (own / 'urdf').mkdir()
    source, mesh = robot_in(own), own / 'meshes' / 'a wheel.stl'
    for uri in (
        'package://foo/meshes/a wheel.stl',
        'model://foo/meshes/a wheel.stl',
        f'file://{mesh}',
        f'file://{str(mesh).replace(" ", "%20")}',
        'file://package://foo/meshes/a wheel.stl',
        '../meshes/a wheel.stl',
        str(mesh),
    ):
        assert find_mesh(uri, source).samefile(mesh), uri


@pytest.mark.parametrize(
    ('uri', 'shown'),
    [
        ('package://foo/meshes/none.stl', "package 'foo' in {own} has no file 'meshes/none.stl'"),
        ('package://foo', "package 'foo' in {own} has no file ''"),
        ('file://package://nowhere/a.stl', "package 'nowhere' is not found; looked for in "),
        ('none.stl', 'there is no file {own}/urdf/none.stl; allowed: '),
        ('file:///none.stl', 'there is no file /none.stl; allowed: '),
        ('https://x/a.stl', 'there is no file '),
        ('', 'there is no file '),
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
