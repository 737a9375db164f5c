"""A robot by its name, its robot file, or its xacro or URDF."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.robot_file import load_robot_file


@pytest.fixture(name='package')
def fixture_package(tmp_path):
    robots = tmp_path / 'package' / 'config' / 'robots'
    robots.mkdir(parents=True)
    for name in ('burger', 'kobuki'):
        (robots / f'{name}.yaml').write_text(f'urdf: ../../urdf/{name}.urdf.xacro\nppr: 2578.33\n')
    return tmp_path / 'package'


def robot_file(folder, text):
    path = folder / 'mine.yaml'
    path.write_text(text)
    return path


def test_a_robot_that_comes_with_the_package_is_taken_by_name(package, tmp_path):
    robot = load_robot_file('kobuki', tmp_path, package, {})
    assert robot.source.file.resolve() == package / 'urdf' / 'kobuki.urdf.xacro'
    assert (robot.ppr, robot.label) == (2578.33, 'kobuki')
    assert robot.where == str(package / 'config' / 'robots' / 'kobuki.yaml')


def test_a_robot_file_has_all_of_a_robot(package, tmp_path):
    (tmp_path / 'ws').mkdir()
    robot_file(
        tmp_path,
        'urdf: sub/mine.xacro\narguments: {laser: true, size: 0.5, wheels: 2, colour: red}\npackages: [ws]\n'
        'ppr: 90\nset: {config.left_joint: a}\n',
    )
    robot = load_robot_file('mine.yaml', tmp_path, package, {'size': '0.7', 'extra': 'x'}, [tmp_path])
    assert robot.source.file == tmp_path / 'sub' / 'mine.xacro'
    assert dict(robot.source.arguments) == {
        'laser': 'true',
        'size': '0.7',
        'wheels': '2',
        'colour': 'red',
        'extra': 'x',
    }
    assert robot.source.package_folders == (tmp_path, tmp_path / 'ws')
    assert (robot.ppr, robot.overrides, robot.label) == (90.0, {'config.left_joint': 'a'}, 'mine')


def test_a_urdf_alone_is_a_robot(package, tmp_path):
    path = tmp_path / 'my.bot.urdf.xacro'
    path.write_text('<robot/>')
    for given in ('my.bot.urdf.xacro', str(path)):
        robot = load_robot_file(given, tmp_path, package, {'b': '1', 'a': '2'})
        assert robot.source == RobotSource(path, (('a', '2'), ('b', '1')))
        assert (robot.ppr, robot.overrides, robot.label, robot.where) == (None, {}, 'my', str(path))


def test_a_name_comes_before_a_file_beside(package, tmp_path):
    (tmp_path / 'burger').write_text('<robot/>')
    assert load_robot_file('burger', tmp_path, package, {}).ppr == 2578.33
    assert load_robot_file('./burger', tmp_path, package, {}).ppr is None


@pytest.mark.parametrize('given', ['burgr', 'burger.yaml', 'none/burger', 'none.urdf', ''])
def test_an_unknown_robot_lists_the_known_ones(package, tmp_path, given):
    with pytest.raises(ConfigError) as caught:
        load_robot_file(given, tmp_path, package, {})
    text = str(caught.value)
    assert f'robot: given {given!r}' in text and 'burger, kobuki, or a .yaml, .xacro or .urdf file' in text
    assert ("did you mean 'burger'" in text) == ('burg' in given)


@pytest.mark.parametrize(
    ('content', 'text'),
    [
        ('urdf: 3', 'urdf: given 3'),
        ('set: {}', 'urdf: missing'),
        ('urdf: a\nwheels: 2', 'wheels: unknown key'),
        ('udrf: a', "udrf: unknown key; did you mean 'urdf'"),
        ('urdf: a\nppr: 0', 'ppr: given 0; allowed: 0.001 to 1e9'),
        ('urdf: a\nppr: many', "ppr: given 'many'"),
        ('urdf: a\narguments: {a: [1]}', 'arguments.a'),
        ('urdf: a\narguments: {a: }', 'arguments.a'),
        ('urdf: a\npackages: [none]', 'packages: given '),
        ('[1', 'not valid YAML'),
    ],
)
def test_a_bad_robot_file_is_named(package, tmp_path, content, text):
    path = robot_file(tmp_path, content)
    with pytest.raises(ConfigError) as caught:
        load_robot_file(str(path), tmp_path, package, {})
    assert str(caught.value).startswith(str(path)) and text in str(caught.value)
    assert '\n' not in str(caught.value)


def test_a_folder_of_packages_must_exist(package, tmp_path):
    with pytest.raises(ConfigError, match="packages: given '.*none'; allowed: a folder that exists"):
        load_robot_file('burger', tmp_path, package, {}, [tmp_path / 'none'])
