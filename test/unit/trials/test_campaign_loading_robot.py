"""A robot of one's own in a campaign: config/robots/alto.yaml as the pattern."""

import shutil

import pytest
import yaml

from campaign_files import ROOT
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.trials.campaign_loading import load_campaign
from urdf_texts import usual

ALTO = ROOT / 'config' / 'robots' / 'alto.yaml'

URDF = ROOT / 'urdf' / 'alto.urdf.xacro'


def campaign(robot, **replace):
    return load_campaign('quick', ROOT, {'robot': str(robot), **replace})


def robot_file(folder, **overrides):
    """A copy of alto.yaml with other numbers, its URDF beside it."""
    content = yaml.safe_load(ALTO.read_text(encoding='utf-8'))
    content['urdf'] = 'robot.xacro'
    content['set'].update({key.replace('__', '.'): value for key, value in overrides.items()})
    shutil.copy(str(URDF), str(folder / 'robot.xacro'))
    path = folder / 'robot.yaml'
    path.write_text(yaml.safe_dump(content), encoding='utf-8')
    return path


def test_the_pattern_is_the_packages_own_robot():
    default, pattern = load_campaign('quick', ROOT), campaign(ALTO)
    assert [cell.robot_params for cell in pattern.cells] == [cell.robot_params for cell in default.cells]
    assert pattern.files == default.files
    assert pattern.fingerprint() == default.fingerprint()


def test_a_robots_numbers_reach_every_cell_and_its_trials(tmp_path):
    other = campaign(robot_file(tmp_path, config__wheel_separation=0.5, simulator__lidar__noise=0.02))
    assert {
        (cell.robot_params.odometry.wheel_separation, cell.robot_params.simulator.lidar.noise) for cell in other.cells
    } == {(0.5, 0.02)}
    assert other.trials()[0].definition().wheel_separation == 0.5
    assert other.fingerprint() != load_campaign('quick', ROOT).fingerprint()


def test_what_a_campaign_sets_comes_before_the_robots(tmp_path):
    robot = robot_file(tmp_path, simulator__lidar__noise=0.02)
    path = tmp_path / 'campaign.yaml'
    path.write_text(
        yaml.safe_dump(
            {'name': 'n', 'tests': ['SL'], 'ppr': [90], 'robot': robot.name, 'set': {'simulator.lidar.noise': 0.05}}
        ),
        encoding='utf-8',
    )
    (cell,) = load_campaign(str(path), ROOT).cells
    assert cell.robot_params.simulator.lidar.noise == 0.05


@pytest.mark.parametrize(
    ('content', 'text'),
    [
        ('urdf: 3', 'urdf: given 3'),
        ('set: {}', 'urdf: missing'),
        ('urdf: none.xacro', 'none.xacro'),
        ('[1', 'not valid YAML'),
    ],
)
def test_a_bad_robot_file_is_named(tmp_path, content, text):
    path = tmp_path / 'robot.yaml'
    path.write_text(content, encoding='utf-8')
    with pytest.raises(ConfigError, match='robot.yaml|none.xacro') as error:
        campaign(path)
    assert text in str(error.value)


def test_a_mesh_that_is_missing_is_named_with_the_robots_file(tmp_path):
    path = robot_file(tmp_path)
    robot = (tmp_path / 'robot.xacro').read_text(encoding='utf-8')
    mesh = '<link name="base_link"><collision><geometry><mesh filename="horn.stl"/></geometry></collision>'
    (tmp_path / 'robot.xacro').write_text(robot.replace('<link name="base_link">', mesh), encoding='utf-8')
    with pytest.raises(ConfigError, match=r"robot.xacro: link 'base_link': collision mesh '.*horn.stl'"):
        campaign(path)


def test_only_closed_loop_trials_need_a_laser(tmp_path):
    (tmp_path / 'blind.urdf').write_text(usual(), encoding='utf-8')
    blind = tmp_path / 'blind.urdf'
    with pytest.raises(ConfigError, match=r'blind.urdf: the robot has no laser, .*laser: \{parent: base_link, xyz: '):
        campaign(blind)
    for taken in (
        campaign(blind, tests=['SL'], nav='scripted'),
        load_campaign('quick', ROOT, {'robot': str(blind)}, has_trials=False),
    ):
        (warning,) = [text for text in taken.robot.warnings if 'laser' in text]
        assert 'laser: {parent: base_link, xyz: ' in warning


def test_a_test_is_driven_no_faster_than_the_robot(tmp_path):
    slow = campaign(robot_file(tmp_path, simulator__drive__max_linear_speed=0.2), tests=['SL'])
    assert {cell.test.limits.speed for cell in slow.cells} == {0.2}


def test_arguments_of_a_xacro_reach_its_file():
    noisy = load_campaign('quick', ROOT, {'robot': str(URDF)}, {'lidar_noise': '0.25'})
    assert {cell.robot_params.simulator.lidar.noise for cell in noisy.cells} == {0.25}
    with pytest.raises(ConfigError, match="argument 'lidar_nose' is not known; did you mean 'lidar_noise'"):
        load_campaign('quick', ROOT, {'robot': str(URDF)}, {'lidar_nose': '0.25'})


def test_packages_of_the_command_line_are_looked_in(tmp_path):
    package = tmp_path / 'elsewhere' / 'my_description'
    package.mkdir(parents=True)
    (package / 'package.xml').write_text('<package><name>my_description</name></package>')
    shutil.copy(str(URDF), str(package / 'parts.xacro'))
    own = tmp_path / 'mine' / 'robot.urdf.xacro'
    own.parent.mkdir()
    own.write_text(
        '<robot name="mine" xmlns:xacro="http://www.ros.org/wiki/xacro">'
        '<xacro:include filename="$(find my_description)/parts.xacro"/></robot>'
    )
    folders = [tmp_path / 'elsewhere']
    assert load_campaign('quick', ROOT, {'robot': str(own)}, {}, folders).robot.name == 'mine'
