"""A robot by its name, robot file or URDF, and the settings that are derived from it."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.robots.describing import LIMITS
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.robot_file import derived_settings, load_robot_file, set_up_robot
from diff_encoder_sim.trials.robot_params import check_key, load_robot_config, override
from urdf_texts import ball, base, described, found, joint, laser_sensor, link, pair, plugin, robot, usual, wheel


@pytest.fixture(name='load')
def fixture_load(tmp_path):
    """Loads robots of a folder, next to a package with two robots."""
    robots = tmp_path / 'package' / 'config' / 'robots'
    robots.mkdir(parents=True)
    for name in ('burger', 'kobuki'):
        (robots / f'{name}.yaml').write_text(f'urdf: ../../urdf/{name}.urdf.xacro\nppr: 2578.33\n')

    def load(given, arguments=None, packages=()):
        return load_robot_file(given, tmp_path, tmp_path / 'package', arguments or {}, packages)

    return load


def test_a_robot_that_comes_with_the_package_is_taken_by_name_before_a_file_beside(load, tmp_path):
    (tmp_path / 'kobuki').write_text('<robot/>')
    kobuki = load('kobuki')
    assert kobuki.source.file.resolve() == tmp_path / 'package' / 'urdf' / 'kobuki.urdf.xacro'
    assert (kobuki.ppr, kobuki.label) == (2578.33, 'kobuki')
    assert kobuki.where == str(tmp_path / 'package' / 'config' / 'robots' / 'kobuki.yaml')
    assert load('./kobuki').ppr is None


def test_a_robot_file_has_all_of_a_robot(load, tmp_path):
    (tmp_path / 'ws').mkdir()
    (tmp_path / 'mine.yaml').write_text(
        'urdf: sub/mine.xacro\narguments: {laser: true, size: 0.5, wheels: 2, colour: red}\npackages: [ws]\n'
        'ppr: 90\nset: {config.left_joint: a}\n'
    )
    mine = load('mine.yaml', {'size': '0.7', 'extra': 'x'}, [tmp_path])
    assert mine.source.file == tmp_path / 'sub' / 'mine.xacro'
    expected = {'laser': 'true', 'size': '0.7', 'wheels': '2', 'colour': 'red', 'extra': 'x'}
    assert dict(mine.source.arguments) == expected
    assert mine.source.package_folders == (tmp_path, tmp_path / 'ws')
    assert (mine.ppr, mine.overrides, mine.label) == (90.0, {'config.left_joint': 'a'}, 'mine')


def test_a_urdf_alone_is_a_robot(load, tmp_path):
    path = tmp_path / 'my.bot.urdf.xacro'
    path.write_text('<robot/>')
    for given in (path.name, str(path)):
        mine = load(given, {'b': '1', 'a': '2'})
        assert mine.source == RobotSource(path, (('a', '2'), ('b', '1')))
        assert (mine.ppr, mine.overrides, mine.label, mine.where) == (None, {}, 'my', str(path))


@pytest.mark.parametrize('given', ['burgr', 'none/burger', 'none.urdf', ''])
def test_an_unknown_robot_lists_the_known_ones(load, given):
    with pytest.raises(ConfigError, match='burger, kobuki, or a .yaml, .xacro or .urdf file') as caught:
        load(given)
    assert f'robot: given {given!r}' in str(caught.value)
    assert ("did you mean 'burger'" in str(caught.value)) == ('burg' in given)


@pytest.mark.parametrize(
    ('content', 'text'),
    [
        ('urdf: ""', 'urdf: given '),
        ('udrf: a', "udrf: unknown key; did you mean 'urdf'"),
        ('urdf: a\narguments: {a: [1]}', 'arguments.a'),
        ('urdf: a\npackages: [none]', 'packages: given '),
    ],
)
def test_a_bad_robot_file_is_named(load, tmp_path, content, text):
    path = tmp_path / 'mine.yaml'
    path.write_text(content)
    with pytest.raises(ConfigError) as caught:
        load(str(path))
    assert str(caught.value).startswith(str(path)) and text in str(caught.value)
    assert '\n' not in str(caught.value)


def set_up(folder, urdf, parent='base_link'):
    (folder / 'mine.urdf').write_text(urdf)
    (folder / 'mine.yaml').write_text(f'urdf: mine.urdf\nlaser: {{parent: {parent}, xyz: [0, 0, 0.3]}}\n')
    return set_up_robot(load_robot_file('mine.yaml', folder, folder, {}))


@pytest.mark.parametrize(('own_link', 'added'), [('', 'laser'), ('laser', 'laser_2'), ('scan', 'laser')])
def test_a_laser_of_the_robot_file_wins_over_those_of_the_urdf(tmp_path, own_link, added):
    own = link(own_link) + joint('own', own_link, '0.2 0 0.2') + laser_sensor(own_link) if own_link else ''
    setup = set_up(tmp_path, usual(own))
    setup.check_laser()
    assert setup.settings['simulator.laser_link'] == setup.description.laser.link == added
    assert setup.description.laser.pose_in_root[:3, 3] == pytest.approx([0.0, 0.0, 0.3])
    notes = [note for note in setup.description.notes if repr(added) in note and repr(own_link) in note]
    assert len(notes) == bool(own_link)
    with pytest.raises(ConfigError, match="mine.urdf: joint 'added_laser_joint': .* did you mean 'base_link'"):
        set_up(tmp_path, usual(), 'base_lin')


EYE = link('eye') + joint('eye_joint', 'eye', '0 0 0.2')


def settings_of(*parts, wheels=pair()):
    return derived_settings(described(robot(base(), wheels, ball('ball', 0.1), *parts)))


def test_all_of_them_are_parameters_and_take_effect():
    wheels = wheel('left', y_m=0.15) + wheel('right', y_m=-0.15, axis='0 -1 0')
    drive = plugin('libdiff_drive.so', leftJoint='left_joint', rightJoint='right_joint', wheelAcceleration=0.5)
    settings = settings_of(EYE, laser_sensor('eye'), drive, wheels=wheels)
    for key in settings:
        check_key(key)
    params = override(load_robot_config(package_folder() / 'config'), settings)
    assert (params.odometry.wheel_diameter.plain, params.odometry.wheel_separation) == (0.1, 0.3)
    assert (params.simulator.laser_link, params.simulator.lidar.samples) == ('eye', 360)
    assert params.navigator.DWAPlannerROS.acc_lim_x == 0.5
    corners = settings['navigation.global_costmap.footprint']
    assert max(y_m for _, y_m in corners) == pytest.approx(0.16, abs=2e-3)  # with the wheels
    assert (settings['config.left_joint'], settings['simulator.right_joint']) == ('left_joint', 'right_joint')
    assert (settings['config.left_reversed'], settings['config.right_reversed']) == (False, True)
    for key in ('config.base_frame', 'amcl.base_frame_id', 'navigation.local_costmap.robot_base_frame'):
        assert settings[key] == 'base_link'


def test_navigator_and_amcl_ask_for_no_more_than_drive_and_scanner_give():
    settings = settings_of(wheels=pair(inside='<limit effort="1" velocity="4"/>'))
    assert settings['simulator.drive.max_linear_speed'] == 0.2
    assert settings['navigation.DWAPlannerROS.max_vel_x'] == 0.2
    assert settings['navigation.DWAPlannerROS.max_vel_theta'] == 1.0
    assert 'navigation.DWAPlannerROS.max_vel_x' not in settings_of()
    assert settings_of(EYE, laser_sensor('eye', ranges=(0.1, 2.0)))['amcl.laser_max_range'] == 2.0


def test_what_is_printed_as_default_is_the_default():
    drive = override(load_robot_config(package_folder() / 'config'), {}).simulator.drive
    printed = {key: value for key, (_, value) in LIMITS.items() if key != 'wheel_torque'}
    assert printed == {key: getattr(drive, key) for key in printed}
    value, source = found(described(usual()), 'highest speed [m/s]')
    assert (value, source) == ('1', "this package's default: the robot's file gives none")
