"""A robot by its name, robot file or URDF, and the settings that are derived from it."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.package_files import package_folder
from diff_encoder_sim.robots.describing import LIMITS
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.robot_file import load_robot_file
from diff_encoder_sim.robots.robot_setup import derived_settings, set_up_robot
from diff_encoder_sim.trials.robot_params import check_key, load_robot_config, load_robot_params, override
from urdf_texts import ball, base, described, found, joint, laser_sensor, link, pair, plugin, robot, usual, wheel


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


def set_up(folder, urdf, laser):
    (folder / 'mine.urdf').write_text(urdf)
    (folder / 'mine.yaml').write_text(f'urdf: mine.urdf\nlaser: {laser}\n')
    return set_up_robot(load_robot_file('mine.yaml', folder, folder, {}))


def test_a_laser_is_added_and_named(tmp_path):
    setup = set_up(tmp_path, usual(), '{parent: base_link, xyz: [0, 0, 0.3]}')
    assert setup.settings['simulator.laser_link'] == 'laser'
    setup.check_laser()


def test_a_laser_on_a_link_that_is_missing(tmp_path):
    with pytest.raises(
        ConfigError, match="mine.urdf: joint 'added_laser_joint': .* 'base_lin'; did you mean 'base_link'"
    ):
        set_up(tmp_path, usual(), '{parent: base_lin, xyz: [0, 0, 0.3]}')


@pytest.mark.parametrize('own_link', ['laser', 'scan'])
def test_a_laser_of_the_robot_file_wins_over_those_of_the_urdf(tmp_path, own_link):
    own = link(own_link) + joint('own', own_link, '0.2 0 0.2') + laser_sensor(own_link)
    setup = set_up(tmp_path, usual(own), '{parent: base_link, xyz: [0, 0, 0.3]}')
    added = 'laser_2' if own_link == 'laser' else 'laser'
    assert setup.settings['simulator.laser_link'] == setup.description.laser.link == added
    assert setup.description.laser.pose_in_root[:3, 3] == pytest.approx([0.0, 0.0, 0.3])
    assert [note for note in setup.description.notes if repr(added) in note and repr(own_link) in note]


def test_a_mesh_of_a_package_that_is_missing_says_where_it_was_looked_for(tmp_path):
    urdf = usual().replace('<box size="0.3 0.2 0.1"/>', '<mesh filename="package://nowhere/a.stl"/>')
    with pytest.raises(ConfigError, match=f"package 'nowhere' is not found; looked for in {tmp_path}, .*PACKAGE_PATH"):
        set_up(tmp_path, urdf, '{parent: base_link, xyz: [0, 0, 0.3]}')


EYE = link('eye') + joint('eye_joint', 'eye', '0 0 0.2')


def settings_of(*parts):
    return derived_settings(described(usual(*parts)))


def test_all_of_them_are_parameters_and_take_effect():
    joints = {'leftJoint': 'left_wheel_joint', 'rightJoint': 'right_wheel_joint'}
    drive = plugin('libdiff_drive.so', **joints, wheelTorque=0.3, wheelAcceleration=0.5)
    settings = settings_of(EYE, laser_sensor('eye'), drive)
    for key in settings:
        check_key(key)
    params = override(load_robot_config(package_folder() / 'config'), settings)
    assert (params.odometry.wheel_diameter, params.odometry.wheel_separation) == (0.1, 0.3)
    assert (params.simulator.laser_link, params.simulator.lidar.samples) == ('eye', 360)
    assert params.navigator.DWAPlannerROS.acc_lim_x == 0.5


def test_wheels_and_frames_are_those_of_the_file():
    reversed_right = wheel('l', y_m=0.1) + wheel('r', y_m=-0.1, axis='0 -1 0')
    settings = derived_settings(described(robot(base(), reversed_right, ball('ball', 0.1))))
    assert (settings['config.left_joint'], settings['simulator.right_joint']) == ('l_joint', 'r_joint')
    assert (settings['config.left_reversed'], settings['config.right_reversed']) == (False, True)
    for key in ('config.base_frame', 'amcl.base_frame_id', 'navigation.local_costmap.robot_base_frame'):
        assert settings[key] == 'base_link'


def test_the_navigator_asks_for_no_more_than_the_drive_gives():
    slow = robot(base(), pair(inside='<limit effort="1" velocity="4"/>'), ball('ball', 0.1))
    settings = derived_settings(described(slow))
    assert settings['simulator.drive.max_linear_speed'] == 0.2
    assert settings['navigation.DWAPlannerROS.max_vel_x'] == 0.2
    assert settings['navigation.DWAPlannerROS.max_vel_theta'] == 1.0
    assert 'navigation.DWAPlannerROS.max_vel_x' not in settings_of()


@pytest.mark.parametrize(('range_max_m', 'used_m'), [(2.0, 2.0), (12.0, 3.5)])
def test_amcl_looks_no_farther_than_the_scanner(range_max_m, used_m):
    assert settings_of(EYE, laser_sensor('eye', ranges=(0.1, range_max_m)))['amcl.laser_max_range'] == used_m


def test_what_is_printed_as_default_is_the_default():
    drive = load_robot_params(package_folder() / 'config').simulator.drive
    printed = {key: value for key, (_, value) in LIMITS.items() if key != 'wheel_torque'}
    assert printed == {key: getattr(drive, key) for key in printed}
    value, source = found(described(usual()), 'highest speed [m/s]')
    assert (value, source) == ('1', "this package's default: the robot's file gives none")


def test_the_footprint_holds_the_wheels():
    corners = settings_of()['navigation.global_costmap.footprint']
    assert max(y_m for _, y_m in corners) == pytest.approx(0.16, abs=2e-3)
    assert corners == settings_of()['navigation.local_costmap.footprint']
