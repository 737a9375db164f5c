"""A user's mistake gets one line: where, which key, what was given, what is allowed."""

import math

import pytest

from diff_encoder_sim.base.bounds import Between
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import (
    LARGEST_INT,
    flat,
    for_xml_rpc,
    from_xml_rpc,
    merged,
    nested,
    split_params,
    with_changes,
)
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from diff_encoder_sim.robots.robot_file import RobotFileParams
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams


@pytest.mark.parametrize(
    ('bounds', 'text', 'allowed', 'refused'),
    [
        (
            Between(1e-3, 100.0, 'm'),
            '0.001 to 100 [m]',
            (1e-3, 1, 100.0),
            (0, 9e-4, 100.1, 10**400, math.nan, math.inf),
        ),
        (Between(-1e6, 1e6), '-1e6 to 1e6', (-1e6,), (-(10**400),)),
        (Between(2, 9, 'counts', or_zero=True), '0, or 2 to 9 [counts]', (0, 2, 9), (1, 1e-300, 10)),
    ],
)
def test_bounds_are_both_allowed_and_read_as_people_write_them(bounds, text, allowed, refused):
    assert str(bounds) == text
    assert all(map(bounds.allows, allowed)) and not any(map(bounds.allows, refused))


@pytest.mark.parametrize(
    ('params_class', 'keys', 'expected'),
    [
        (EncoderParams, {'pprr': 90}, r"pprr: unknown key; did you mean 'ppr'\?"),
        (EncoderParams, {'encoder': {'sensors': 'hall'}}, "encoder.sensors: unknown key; did you mean 'sensor'?"),
        (EncoderParams, {'ppr': {'left': 1, 'right': 2, 'rigt': 2}}, "ppr.rigt: .* did you mean 'right'?"),
        (RobotFileParams, {'urdf': 'a', 'laser': {'parant': 'b'}}, "laser.parant: .* did you mean 'parent'?"),
        (
            NavigatorParams,
            {'recovery_behaviors': [{'name': 'a', 'tpye': 'b'}]},
            "recovery_behaviors.0.tpye: .* 'type'?",
        ),
    ],
)
def test_a_misspelt_key_is_looked_up_in_the_struct_that_it_is_in(params_class, keys, expected):
    with pytest.raises(ConfigError, match=f'^{expected}'):
        params_class.from_mapping(keys, '')


def test_a_shared_file_serves_several_structs_and_still_finds_misspellings():
    encoder, odometry = split_params(
        {'ppr': 40, 'rate': 10.0, 'wheel_diameter': 0.3}, 'c.yaml', EncoderParams, OdometryParams
    )
    assert (encoder.rate, odometry.wheel_diameter.plain, odometry.ppr.left) == (10.0, 0.3, 40)
    with pytest.raises(ConfigError, match=r"c\.yaml: wheel_diametre: unknown.*'wheel_diameter'"):
        split_params({'wheel_diametre': 0.3}, 'c.yaml', EncoderParams, OdometryParams)


def test_changes_are_checked_together_with_what_was_given():
    params = EncoderParams.from_mapping({'ppr': 40, 'encoder': {'lines': 10}}, '')
    changed = with_changes(params, {'rate': 10.0, 'encoder': {'decoding': 'x1'}}, '')
    assert (changed.ppr, changed.rate, changed.counts_per_turn.left) == (params.ppr, 10.0, 10.0)
    assert with_changes(changed, {}, '') == changed
    with pytest.raises(ConfigError, match=r'^rate: given -1\.0; allowed: 0\.001 to 1e6'):
        with_changes(params, {'rate': -1.0}, '')


NESTED = {'lidar': {'noise': 0.03, 'samples': 360}, 'laser_link': 'laser', 'corners': [[0, 1], [1, 0]]}
FLAT = {'lidar.noise': 0.03, 'lidar.samples': 360, 'laser_link': 'laser', 'corners': [[0, 1], [1, 0]]}


def test_nested_and_flat_are_inverse_and_the_mapping_above_wins_value_by_value():
    assert dict(flat(NESTED)) == FLAT and nested(FLAT) == NESTED
    above = {'lidar': {'noise': 0.01}, 'laser_link': {'name': 'x'}, 'corners': []}
    assert merged(NESTED, above) == {
        'lidar': {'noise': 0.01, 'samples': 360},
        'laser_link': {'name': 'x'},
        'corners': [],
    }
    assert merged({'ppr': {'left': 40}}, {'ppr': 90}) == {'ppr': 90}


@pytest.mark.parametrize('number', [LARGEST_INT + 1, 2**32, -(2**40), 2**63 - 1])
def test_a_large_number_is_text_on_the_way_through_xml_rpc(number):
    value = {'a': {'b': [1, number, 1e12, True, 'text']}}
    sent = for_xml_rpc(value)
    assert sent == {'a': {'b': [1, str(number), 1e12, True, 'text']}}
    assert from_xml_rpc(sent) == value


@pytest.mark.parametrize('value', [LARGEST_INT, -LARGEST_INT, 0, '90', '0100000000000', '1e12', None])
def test_what_fits_and_what_is_no_number_stays(value):
    assert for_xml_rpc(value) == from_xml_rpc(value) == value
