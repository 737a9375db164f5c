"""Costmap parameters in upstream's forms: layers, flat names, sources of any name."""

import math

import pytest

from diff_encoder_sim.navigation.costmap_params import CostmapParams
from upstream_params import COSTMAP, FLAT, PLUGINS, SCAN_SOURCE, upstream_navigation


def test_the_flat_form_is_the_layered_one():
    source = {**SCAN_SOURCE, 'data_type': 'LaserScan'}
    flat = {**COSTMAP, **FLAT, 'static_map': True, 'map_type': 'costmap', 'scan': source}
    layered = upstream_navigation()['global_costmap']
    assert CostmapParams.from_mapping(flat, '') == CostmapParams.from_mapping(layered, '')


def test_what_the_costmap_says_goes_before_what_the_layer_says():
    layered = {**upstream_navigation()['global_costmap'], 'inflation_radius': 0.8}
    assert CostmapParams.from_mapping(layered, '').inflation_radius == 0.8


def test_layers_count_without_a_list_of_plugins():
    params = CostmapParams.from_mapping({'inflation_layer': {'inflation_radius': 0.7}}, '')
    assert params.inflation_radius == 0.7


def test_layers_that_are_not_listed_are_not_there():
    params = CostmapParams.from_mapping({'plugins': PLUGINS[:1], 'static_map': False}, '')
    assert (params.static_map, params.observation_sources, params.inflation_radius) == (True, '', 0.0)


@pytest.mark.parametrize('form', [{}, {'plugins': PLUGINS}])
def test_layers_that_are_not_enabled_have_no_effect(form):
    """As dynamic_reconfigure leaves them on the parameter server."""
    layers = {'inflation_layer': {'enabled': False, 'inflation_radius': 0.7}, 'obstacle_layer': {'enabled': False}}
    laser = {'observation_sources': 'laser', 'laser': {'topic': '/scan', 'data_type': 'LaserScan'}}
    params = CostmapParams.from_mapping({**form, **layers, **laser}, '')
    assert (params.observation_sources, params.inflation_radius) == ('', 0.0)


def test_the_laser_may_have_any_name():
    params = CostmapParams.from_mapping(
        {
            'observation_sources': 'front_laser',
            'front_laser': {'topic': '/scan', 'data_type': 'LaserScan', 'clearing': False, 'obstacle_range': 1.5},
        },
        '',
    )
    assert (params.observation_sources, params.scan.clearing, params.obstacle_range) == ('scan', False, 1.5)


def test_a_round_robot_is_a_polygon_of_16_corners():
    """costmap_2d/src/footprint.cpp, makeFootprintFromRadius; a footprint counts before the radius."""
    params = CostmapParams.from_mapping({'robot_radius': 0.2}, '')
    assert len(params.footprint) == 16
    assert all(math.hypot(*corner) == pytest.approx(0.2) for corner in params.footprint)
    square = [[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]]
    both = CostmapParams.from_mapping({'robot_radius': 0.2, 'footprint': square}, '')
    assert both.footprint == square
