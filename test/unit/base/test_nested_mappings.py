"""Mappings within mappings."""

from diff_encoder_sim.base.params import flat, merged, nested

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


def test_neither_argument_is_changed():
    below, above = {'a': {'b': 1}}, {'a': {'c': 2}}
    merged(below, above)
    assert (below, above) == ({'a': {'b': 1}}, {'a': {'c': 2}})
