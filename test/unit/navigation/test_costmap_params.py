"""Costmap parameters that make no costmap."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.navigation.costmap_params import CostmapParams
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from upstream_params import PLUGINS


@pytest.mark.parametrize(
    'params',
    [
        {'rolling_window': True, 'static_map': True},
        {'static_map': False},
        {'observation_sources': 'sonar'},
        {'rolling_window': True, 'resolution': 0.0005},
    ],
)
def test_params_that_make_no_costmap_are_refused(params):
    with pytest.raises(ConfigError):
        CostmapParams.from_mapping(params, 'costmap.yaml')


REFUSED = {
    'another layer': (
        {'plugins': [{'name': 'v', 'type': 'costmap_2d::VoxelLayer'}]},
        'costmap_2d::StaticLayer, costmap_2d::ObstacleLayer',
    ),
    'order': ({'plugins': PLUGINS[::-1]}, 'in this order'),
    'no list': ({'plugins': 'static_layer'}, 'a list of'),
    'layer is no mapping': ({'plugins': PLUGINS, 'static_layer': 3}, 'static_layer: a mapping'),
    'switched off': ({'plugins': PLUGINS, 'static_layer': {'enabled': False}}, 'static_layer.enabled: true; take'),
    'half on': ({'inflation_layer': {'enabled': 'half'}}, 'inflation_layer.enabled: true or false'),
    'misspelt in a layer': (
        {'plugins': PLUGINS, 'inflation_layer': {'inflation_radios': 0.5}},
        'inflation_radios: unknown key',
    ),
    'voxels': ({'map_type': 'voxel'}, "map_type: given 'voxel'; allowed: 'costmap'"),
    'two lasers': ({'observation_sources': 'front rear'}, 'one laser, not 2'),
    'points': ({'scan': {'data_type': 'PointCloud2'}}, "scan.data_type: given 'PointCloud2'"),
    'another topic': ({'scan': {'topic': '/base_scan'}}, 'remap'),
    'topic by the source': ({'observation_sources': 'laser', 'laser': {}}, "given 'laser'"),
    'source is no mapping': ({'observation_sources': 'laser', 'laser': 3}, 'laser: a mapping'),
    'maximum': ({'use_maximum': True}, 'use_maximum: given True; allowed: False'),
    'too fine': (
        {'plugins': PLUGINS[1:], 'rolling_window': True, 'resolution': 1e-3, 'width': 6.0, 'height': 6.0},
        '4000000 cells',
    ),
    'radius': ({'robot_radius': -0.2}, 'robot_radius: 0.001 to 100 [m], not -0.2'),
    'radius is text': ({'robot_radius': 'wide'}, "not 'wide'"),
}


@pytest.mark.parametrize('name', list(REFUSED))
def test_what_the_costmap_cannot_do_is_named_in_one_line(name):
    given, complaint = REFUSED[name]
    with pytest.raises(ConfigError) as caught:
        NavigatorParams.from_mapping({'global_costmap': given}, '/move_base')
    assert complaint in str(caught.value)
    assert str(caught.value).startswith('/move_base: global_costmap')
    assert '\n' not in str(caught.value)


def test_a_rolling_window_needs_no_static_map_to_be_switched_off():
    params = NavigatorParams.from_mapping({'local_costmap': {'rolling_window': True, 'global_frame': 'odom'}}, '')
    assert (params.local_costmap.static_map, params.local_costmap.track_unknown_space) == (False, False)
