"""A robot by name, file or URDF; what is wrong is named with the robot's file."""

import pytest
import yaml

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.trials.robot_params import load_robot, load_robot_config, load_robot_params, override
from places import CONFIG, ROOT

ALTO = ROOT / 'urdf' / 'alto.urdf.xacro'
NAMES = sorted(path.stem for path in (CONFIG / 'robots').glob('*.yaml'))


def loaded(given, folder=ROOT, **arguments):
    return load_robot(str(given), folder, ROOT, arguments)


@pytest.mark.parametrize('name', NAMES)
def test_every_robot_that_comes_with_the_package_is_loaded_by_name(name):
    robot = loaded(name)
    params = override(load_robot_config(CONFIG), robot.settings)
    assert params.encoder.left_joint == params.simulator.left_joint == robot.description.left.joint
    assert params.odometry.base_frame == params.amcl.base_frame_id == robot.description.tree.root
    assert params.navigator.global_costmap.footprint == params.navigator.local_costmap.footprint
    assert params.navigator.DWAPlannerROS.max_vel_x <= params.simulator.drive.max_linear_speed


def test_without_a_robot_it_is_alto_with_the_parameters_of_config():
    robot = loaded('')
    assert robot.name == 'alto'
    nominal = {'wheel_diameter': 0.0, 'wheel_separation': 0.0}  # as in the URDF, or the same numbers
    params = override(load_robot_config(CONFIG), robot.settings)
    params = params._replace(simulator=params.simulator.model_copy(update=nominal))
    assert params == load_robot_params(CONFIG)


def test_a_robot_files_word_on_joints_and_wheels_is_taken_for_the_simulation_too(tmp_path):
    path = tmp_path / 'robot.yaml'
    path.write_text(yaml.safe_dump({'urdf': str(ALTO), 'set': {'simulator.wheel_separation': 0.5}}))
    robot = loaded(path)
    assert robot.description.wheel_separation_m == 0.5
    assert robot.settings['config.wheel_separation'] == 0.5  # what odometry assumes, unless it is set


def test_what_odometry_assumes_may_differ_from_the_simulated_wheels(tmp_path):
    path = tmp_path / 'robot.yaml'
    path.write_text(yaml.safe_dump({'urdf': str(ALTO), 'set': {'config.wheel_separation': 0.5}}))
    robot = loaded(path)
    assert robot.description.wheel_separation_m == pytest.approx(0.4)
    assert robot.settings['config.wheel_separation'] == 0.5


@pytest.mark.parametrize(
    ('settings', 'expected'),
    [
        ({'config.ppr': 90}, 'robot.yaml: set: config.ppr: every trial sets it'),
        ({'config.base_frme': 'b'}, "robot.yaml: set: config.base_frme: unknown key; did you mean 'config.base_frame'"),
        ({'simulator.lidar.noise': 'much'}, "robot.yaml: simulator: lidar.noise: given 'much'"),
        ({'simulator.left_joint': 3}, 'robot.yaml: simulator.left_joint: given 3; allowed: a name'),
        ({'simulator.wheel_diameter': 'big'}, "robot.yaml: simulator.wheel_diameter: given 'big'; allowed: a number"),
        ({'simulator.left_joint': 'lft'}, "alto.urdf.xacro: given 'lft' as left wheel joint, which is missing"),
    ],
)
def test_a_mistake_is_named_with_the_robots_file(tmp_path, settings, expected):
    path = tmp_path / 'robot.yaml'
    path.write_text(yaml.safe_dump({'urdf': str(ALTO), 'set': settings}))
    with pytest.raises(ConfigError) as error:
        loaded(path)
    assert expected in str(error.value) and '\n' not in str(error.value)
