"""Packages and meshes are found as ROS would, and without it."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.package_search import SEARCH_VARIABLES, find_mesh, find_package


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
    assert find_package('foo_description', RobotSource(tmp_path / 'x' / 'r.urdf', (), (tmp_path,))) == own


def test_a_robots_own_package_takes_precedence_over_named_folders(tmp_path):
    own = package(tmp_path / 'a' / 'foo-2.0', 'foo_description')
    beside = package(tmp_path / 'a' / 'bar', 'bar')
    other = package(tmp_path / 'b' / 'foo_description'), package(tmp_path / 'b' / 'bar')
    source = robot_in(own, tmp_path / 'b')
    assert find_package('foo_description', source) == own
    assert find_mesh('package://foo_description/meshes/wheel.stl', source) == own / 'meshes' / 'wheel.stl'
    assert find_package('bar', source) == other[1] != beside


def test_named_folders_are_packages_or_hold_some_levels_down(tmp_path):
    lone = package(tmp_path / 'a' / 'lone')
    deep = package(tmp_path / 'b' / 'src' / 'repo' / 'deep_folder', 'deep')
    package(tmp_path / 'b' / '.git' / 'hidden')
    package(tmp_path / 'b' / 'ignored' / 'unused')
    (tmp_path / 'b' / 'ignored' / 'CATKIN_IGNORE').touch()
    source = RobotSource(tmp_path / 'c' / 'r.urdf', (), (lone, tmp_path / 'b', tmp_path / 'none'))
    assert find_package('lone', source) == lone
    assert find_package('deep', source) == deep
    assert find_package('hidden', source) is None and find_package('unused', source) is None


@pytest.mark.parametrize(('variable', 'place'), [('ROS_PACKAGE_PATH', 'stack/foo'), ('AMENT_PREFIX_PATH', 'share/foo')])
def test_packages_of_ros_are_found(tmp_path, monkeypatch, variable, place):
    installed = package(tmp_path / 'ros' / place)
    monkeypatch.setenv(variable, f'/nowhere:{tmp_path / "ros"}')
    assert find_package('foo', RobotSource(tmp_path / 'r.urdf')) == installed


def test_ros_comes_last(tmp_path, monkeypatch):
    near, ros, named = (package(tmp_path / name / 'foo') for name in ('near', 'ros', 'named'))
    monkeypatch.setenv('ROS_PACKAGE_PATH', str(tmp_path / 'ros'))
    elsewhere = tmp_path / 'elsewhere'
    assert find_package('foo', robot_in(elsewhere, tmp_path / 'named')) == named
    assert find_package('foo', robot_in(near)) == near
    assert find_package('foo', robot_in(elsewhere)) == ros


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
    for uri in ('package://foo/none.stl', 'package://none/a.stl', 'https://x/a.stl', 'none.stl', '', 'package://foo'):
        with pytest.raises(ConfigError):
            find_mesh(uri, source)


def test_an_error_shows_whether_the_file_or_its_package_is_missing(tmp_path):
    own = package(tmp_path / 'foo')
    for uri, shown in (
        ('package://foo/meshes/none.stl', f"package 'foo' in {own} has no file 'meshes/none.stl'"),
        ('file://package://nowhere/a.stl', "package 'nowhere' is not found; looked for in "),
        ('none.stl', f'there is no file {own / "urdf" / "none.stl"}; allowed: '),
        ('file:///none.stl', 'there is no file /none.stl; allowed: '),
    ):
        with pytest.raises(ConfigError) as caught:
            find_mesh(uri, robot_in(own))
        assert str(caught.value).startswith(shown)


def test_a_description_that_was_copied_without_its_package_finds_its_meshes(tmp_path):
    copied = package(tmp_path / 'downloads', None)
    assert find_mesh('package://foo/meshes/wheel.stl', robot_in(copied)) == copied / 'meshes' / 'wheel.stl'
