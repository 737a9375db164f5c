"""The parameters of all parts of a robot, from the files of config/ and from overrides."""

import shutil

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.trials.robot_params import (
    CONFIG_FILES,
    RobotParams,
    check_key,
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


def test_a_part_is_found_by_its_name_in_whatever_order_the_files_are_listed(monkeypatch):
    expected = load_robot_params(ROOT / 'config')
    for stem, classes in list(CONFIG_FILES.items())[::-1]:
        monkeypatch.delitem(CONFIG_FILES, stem)
        monkeypatch.setitem(CONFIG_FILES, stem, dict(list(classes.items())[::-1]))
    assert load_robot_params(ROOT / 'config') == expected


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


@pytest.mark.parametrize(
    ('overrides', 'complaint'),
    [
        ({'config.rate': 0}, '^config: rate: given 0'),
        (
            {'navigation.DWAPlannerROS.latch_xy_goal_tolerance': False},
            'given False has no effect: another key of config/nav',
        ),
    ],
)
def test_an_override_without_effect_or_out_of_range_is_refused(overrides, complaint):
    with pytest.raises(ConfigError, match=complaint):
        override(CONFIG, overrides)


def test_a_key_that_no_file_has_or_that_trials_set_is_refused():
    check_key('simulator.lidar.noise')
    with pytest.raises(ConfigError, match="config.rat: unknown key; did you mean 'config.rate'"):
        check_key('config.rat')
    with pytest.raises(ConfigError, match='config.ppr: every trial sets it'):
        check_key('config.ppr')
