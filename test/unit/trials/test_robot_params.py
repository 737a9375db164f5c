"""The parameters of all parts of a robot, from the files of config/ and from overrides."""

import shutil

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.trials.robot_params import (
    CONFIG_FILES,
    RobotParams,
    load_robot_config,
    load_robot_params,
    override,
)
from places import ROOT

CONFIG = load_robot_config(ROOT / 'config')


def test_every_part_has_the_parameters_of_its_own_class():
    params = load_robot_params(ROOT / 'config')
    classes = {field: of_file[field] for of_file in CONFIG_FILES.values() for field in of_file}
    assert {field: type(part) for field, part in params._asdict().items()} == classes
    assert set(classes) == set(RobotParams._fields)


def test_a_file_that_is_missing_or_bad_is_named(tmp_path):
    folder = tmp_path / 'config'
    shutil.copytree(ROOT / 'config', folder)
    (folder / 'amcl.yaml').write_text('max_particles: many\n')
    for load in (load_robot_params, load_robot_config):
        with pytest.raises(ConfigError, match=f"^{folder}/amcl.yaml: max_particles: given 'many'"):
            load(folder)
    (folder / 'amcl.yaml').unlink()
    with pytest.raises(ConfigError, match='amcl.yaml: cannot be read'):
        load_robot_params(folder)


def test_overrides_change_what_they_name_and_nothing_else():
    params, default = override(CONFIG, {'config.rate': 50, 'simulator.lidar.noise': 0.0}), override(CONFIG, {})
    assert (params.encoder.rate, params.simulator.lidar.noise) == (50.0, 0.0)
    assert params.odometry == default.odometry and params.simulator.drive == default.simulator.drive
    assert override(CONFIG, {}) == default == load_robot_params(ROOT / 'config')
