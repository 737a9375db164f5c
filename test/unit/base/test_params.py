"""A user's mistake gets one line: where, which key, what was given, what is allowed."""

import math

import pytest
from pydantic import model_validator

from diff_encoder_sim.base.bounds import Between
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import (
    Params,
    flat,
    load_params,
    merged,
    missing,
    nested,
    not_allowed,
    split_params,
    with_changes,
)
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from diff_encoder_sim.robots.robot_file import RobotFileParams
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams


@pytest.mark.parametrize(
    ('bounds', 'text'),
    [
        (Between(1e-3, 100.0, 'm'), '0.001 to 100 [m]'),
        (Between(-1e6, 1e6), '-1e6 to 1e6'),
        (Between(2, 9, 'counts', or_zero=True), '0, or 2 to 9 [counts]'),
    ],
)
def test_bounds_read_as_people_write_them(bounds, text):
    assert str(bounds) == text


def test_both_bounds_are_allowed_and_nothing_beyond():
    bounds = Between(1e-3, 100.0, 'm')
    assert all(map(bounds.allows, (1e-3, 1, 100.0)))
    assert not any(map(bounds.allows, (0, 0.0, 9e-4, 100.1, 10**400, -(10**400), math.nan, math.inf)))


def test_zero_may_turn_something_off():
    bounds = Between(1e-3, 100.0, 'm', or_zero=True)
    assert bounds.allows(0)
    assert not bounds.allows(1e-300)


def test_a_misspelt_key_is_named_with_what_was_probably_meant():
    with pytest.raises(ConfigError, match=r"f\.yaml: pprr: unknown key; did you mean 'ppr'\?"):
        EncoderParams.from_mapping({'pprr': 90}, 'f.yaml')


@pytest.mark.parametrize(
    ('params_class', 'keys', 'expected'),
    [
        (EncoderParams, {'encoder': {'sensors': 'hall'}}, "encoder.sensors: unknown key; did you mean 'sensor'?"),
        (EncoderParams, {'ppr': {'left': 1, 'right': 2, 'rigt': 2}}, "ppr.rigt: .* did you mean 'right'?"),
        (RobotFileParams, {'urdf': 'a', 'laser': {'parant': 'b'}}, "laser.parant: .* did you mean 'parent'?"),
        (
            NavigatorParams,
            {'recovery_behaviors': [{'name': 'a', 'tpye': 'b'}]},
            "recovery_behaviors.0.tpye: .* did you mean 'type'?",
        ),
    ],
)
def test_a_misspelt_key_is_looked_up_in_the_struct_that_it_is_in(params_class, keys, expected):
    with pytest.raises(ConfigError, match=f'^{expected}'):
        params_class.from_mapping(keys, '')


class Interval(Params):
    """Two keys that a validator compares, and one that the other asks for."""

    first: float = 0.0
    last: float = 1.0
    unit: str = ''

    @model_validator(mode='after')
    def _check(self):
        if self.first > self.last:
            raise not_allowed('first', self.first, f'up to last, {self.last}')
        if self.last > 100.0 and not self.unit:
            raise missing('unit')
        return self


class Pair(Params):
    """A struct with another below."""

    interval: Interval = Interval()


def test_a_validator_of_several_keys_names_the_one_at_fault():
    for params_class, keys, above in (
        (Interval, lambda value: value, ''),
        (Pair, lambda value: {'interval': value}, 'interval.'),
    ):
        with pytest.raises(ConfigError, match=rf'^f: {above}first: given 3\.0; allowed: up to last, 2\.0$'):
            params_class.from_mapping(keys({'first': 3.0, 'last': 2.0}), 'f')
        with pytest.raises(ConfigError, match=f'^f: {above}unit: missing$'):
            params_class.from_mapping(keys({'last': 200.0}), 'f')


def test_a_shared_file_serves_several_structs_and_still_finds_misspellings():
    encoder, odometry = split_params(
        {'ppr': 40, 'rate': 10.0, 'wheel_diameter': 0.3}, 'c.yaml', EncoderParams, OdometryParams
    )
    assert (encoder.rate, odometry.wheel_diameter, odometry.ppr.left) == (10.0, 0.3, 40)
    with pytest.raises(ConfigError, match=r"c\.yaml: wheel_diametre: unknown.*'wheel_diameter'"):
        split_params({'wheel_diametre': 0.3}, 'c.yaml', EncoderParams, OdometryParams)


@pytest.mark.parametrize(
    ('content', 'complaint'),
    [
        (b'ppr: [1', r'line \d: not valid YAML'),
        (b'- a\n- b\n', 'given a list'),
        (b'ppr: !!python/object/apply:os.system ["false"]', 'not valid YAML'),
        (b'ppr: 0\n', 'ppr: given 0'),
    ],
)
def test_a_bad_file_is_named(tmp_path, content, complaint):
    path = tmp_path / 'bad.yaml'
    path.write_bytes(content)
    with pytest.raises(ConfigError, match=complaint) as caught:
        load_params(EncoderParams, path)
    assert str(caught.value).startswith(str(path))
    assert '\n' not in str(caught.value)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ConfigError, match=r'nowhere\.yaml: cannot be read: No such file'):
        load_yaml(tmp_path / 'nowhere.yaml')


def test_an_empty_file_means_all_defaults(tmp_path):
    path = tmp_path / 'empty.yaml'
    path.write_text('# nothing\n')
    assert load_params(EncoderParams, path) == EncoderParams()


def test_changes_are_checked_together_with_what_was_given():
    params = EncoderParams.from_mapping({'ppr': 40}, '')
    changed = with_changes(params, {'rate': 10.0}, '')
    assert (changed.ppr, changed.rate) == (params.ppr, 10.0)
    assert with_changes(changed, {}, '') == changed
    with pytest.raises(ConfigError, match=r'^rate: given -1\.0; allowed: 0\.001 to 1e6'):
        with_changes(params, {'rate': -1.0}, '')


NESTED = {'lidar': {'noise': 0.03, 'samples': 360}, 'laser_link': 'laser', 'corners': [[0, 1], [1, 0]]}


FLAT = {'lidar.noise': 0.03, 'lidar.samples': 360, 'laser_link': 'laser', 'corners': [[0, 1], [1, 0]]}


def test_nested_and_flat_are_inverse():
    assert dict(flat(NESTED)) == FLAT
    assert nested(FLAT) == NESTED


def test_the_mapping_above_wins_value_by_value():
    assert merged(NESTED, {'lidar': {'noise': 0.01}, 'corners': []}) == {
        'lidar': {'noise': 0.01, 'samples': 360},
        'laser_link': 'laser',
        'corners': [],
    }


def test_a_mapping_replaces_a_single_value_and_a_single_value_a_mapping():
    assert merged({'ppr': 90}, {'ppr': {'left': 40}}) == {'ppr': {'left': 40}}
    assert merged({'ppr': {'left': 40}}, {'ppr': 90}) == {'ppr': 90}
