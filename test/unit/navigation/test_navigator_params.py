"""Parameters of navigation: upstream's tree and its forms, and what is refused."""

import math

import pytest

import upstream_params as upstream
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.params import split_params
from diff_encoder_sim.navigation.costmap_params import CostmapParams
from diff_encoder_sim.navigation.navigator_params import ROTATE, DwaParams, NavigatorParams
from navigation_simulation import TABLE_2


def test_the_navigator_takes_every_parameter_of_upstream_at_its_default():
    (params,) = split_params(upstream.upstream_navigation(), 'move_base', NavigatorParams)  # as the node does
    assert params.global_costmap.static_map and not params.local_costmap.static_map
    assert params.DWAPlannerROS.goal_distance_bias == 0.8
    for costmap in (params.global_costmap, params.local_costmap):
        assert (costmap.obstacle_range, costmap.raytrace_range) == (2.5, 3.0)
        assert costmap.transform_tolerance == 0.3  # not the obstacle layer's
        assert not costmap.scan.clearing  # as upstream: clearing is off by default
        assert not costmap.track_unknown_space  # the costmap's counts before a layer's


NO_COSTMAP = [
    ({'rolling_window': True, 'static_map': True}, 'static_map'),
    ({'static_map': False}, 'static_map'),
    ({'observation_sources': 'sonar'}, 'scan.topic'),
    ({'observation_sources': 'front rear'}, 'observation_sources'),
    ({'plugins': [{'name': 'v', 'type': 'costmap_2d::VoxelLayer'}]}, 'plugins'),
    ({'plugins': upstream.PLUGINS, 'static_layer': {'enabled': False}}, 'static_layer.enabled'),
    ({'plugins': upstream.PLUGINS, 'inflation_layer': {'inflation_radios': 0.5}}, 'inflation_radios'),
    ({'map_type': 'voxel'}, 'map_type'),
    ({'scan': {'data_type': 'PointCloud2'}}, 'scan.data_type'),
    ({'scan': {'topic': '/base_scan'}}, 'scan.topic'),
    ({'plugins': upstream.PLUGINS[1:], 'rolling_window': True, 'resolution': 1e-3}, 'cells'),
    ({'robot_radius': -0.2}, 'robot_radius'),
    ({'footprint': [[0, 1], [1, 0]]}, 'footprint'),
    ({'footprint': [[1, 1], [2, 1], [2, 2]]}, 'footprint'),
    ({'footprint': 'round'}, 'footprint'),
]


@pytest.mark.parametrize(
    ('given', 'key'),
    [
        ({'base_local_planner': 'teb_local_planner/TebLocalPlannerROS'}, 'base_local_planner'),
        ({'base_global_planner': 'global_planner/GlobalPlanner'}, 'base_global_planner'),
        # Upstream's default is map: the robot would take its odometry for where it is on the map.
        ({'local_costmap': {'rolling_window': True}}, 'local_costmap'),
        ({'local_costmap': {'rolling_window': True, 'global_frame': '/map'}}, 'local_costmap'),
        ({'recovery_behaviors': [{'name': 'a', 'type': 'move_slow_and_clear/MoveSlowAndClear'}]}, 'recovery_behaviors'),
        ({'recovery_behaviors': 2 * [{'name': 'a', 'type': ROTATE}]}, 'recovery_behaviors'),
        ({'DWAPlannerROS': {'min_vel_x': 0.6}}, 'min_vel_x'),
        # 0.7 m/s^2 in 50 ms is 0.035 m/s: a robot that could never start.
        ({'DWAPlannerROS': {**TABLE_2, 'min_vel_trans': 0.1, 'min_vel_theta': 0.4}}, 'min_vel_trans'),
        *(({'global_costmap': costmap}, f'^/move_base: global_costmap.*{key}') for costmap, key in NO_COSTMAP),
    ],
)
def test_an_unsupported_value_is_named(given, key):
    with pytest.raises(ConfigError, match=key):
        NavigatorParams.from_mapping(given, '/move_base')


@pytest.mark.parametrize(
    ('given', 'latches'),
    [
        ({'latch_xy_goal_tolerance': True}, True),
        ({'DWAPlannerROS': {'latch_xy_goal_tolerance': True}}, True),
        ({'latch_xy_goal_tolerance': False, 'DWAPlannerROS': {'latch_xy_goal_tolerance': True}}, False),
    ],
)
def test_the_latch_is_read_where_upstream_reads_it(given, latches):
    params = NavigatorParams.from_mapping(given, '')
    assert params.DWAPlannerROS.latch_xy_goal_tolerance == latches


# Parameters that upstream does not have and ignores; those of navfn are global_planner's.
OWN_MOVE_BASE = {'input_timeout', 'max_unseen_travel'}
OWN_NAVFN = {'use_dijkstra', 'neutral_cost', 'cost_factor'}
OWN_DWA = {'twist_sigmas', 'latch_margin', 'stop', 'turn_to_path_angle'}
# Upstream reads them in the layers' namespaces alone; its defaults are the same.
IN_LAYERS = {'combination_method', 'footprint_clearing_enabled', 'trinary_costmap', 'unknown_cost_value'}
# As dynamic_reconfigure leaves them on the parameter server.
DISABLED = {'inflation_layer': {'enabled': False, 'inflation_radius': 0.7}, 'obstacle_layer': {'enabled': False}}


def test_upstream_knows_every_parameter_of_our_navigation_yaml_and_its_type():
    ours = upstream.read_config('navigation.yaml')
    parts = {'global_costmap', 'local_costmap', 'NavfnROS', 'DWAPlannerROS'}
    assert set(ours) - upstream.MOVE_BASE_NAMES - parts <= OWN_MOVE_BASE
    assert set(ours['DWAPlannerROS']) - set(upstream.DWA) <= OWN_DWA
    assert set(ours['NavfnROS']) - set(upstream.NAVFN) <= OWN_NAVFN
    for costmap in (ours['global_costmap'], ours['local_costmap']):
        assert set(costmap) <= set(upstream.COSTMAP) | upstream.FLAT_NAMES | IN_LAYERS
        assert set(costmap['scan']) <= set(upstream.SCAN_SOURCE)
    tables = upstream.MOVE_BASE, upstream.DWA, upstream.COSTMAP, upstream.SCAN_SOURCE, upstream.FLAT
    assert upstream.wrong_types(ours, tables) == []


def test_what_our_file_leaves_out_is_the_same_in_both_stacks():
    """A default that differs must stand in the file."""
    ours, params = upstream.read_config('navigation.yaml'), NavigatorParams.from_mapping({}, '')
    assert upstream.different(upstream.MOVE_BASE, params, ours) == set()
    assert upstream.different(upstream.NAVFN, params.NavfnROS, ours['NavfnROS']) == set()
    assert upstream.different(upstream.DWA, params.DWAPlannerROS, ours['DWAPlannerROS']) == set()
    # The size of the global one is the map's.
    costmaps = ('global_costmap', CostmapParams(), {'width', 'height'}), ('local_costmap', params.local_costmap, set())
    for name, costmap, other in costmaps:
        defaults, given = {**upstream.COSTMAP, **upstream.FLAT, 'static_map': False}, ours[name]
        assert upstream.different(defaults, costmap, given) <= other
        of_scan = upstream.different(upstream.SCAN_SOURCE, costmap.scan, given['scan'])
        assert of_scan <= {'obstacle_range', 'raytrace_range'}


def test_the_flat_form_is_the_layered_one_and_goes_before_it():
    source = {**upstream.SCAN_SOURCE, 'data_type': 'LaserScan'}
    flat = {**upstream.COSTMAP, **upstream.FLAT, 'static_map': True, 'map_type': 'costmap', 'scan': source}
    layered = upstream.upstream_navigation()['global_costmap']
    assert CostmapParams.from_mapping(flat, '') == CostmapParams.from_mapping(layered, '')
    assert CostmapParams.from_mapping({**layered, 'inflation_radius': 0.8}, '').inflation_radius == 0.8


@pytest.mark.parametrize(
    'given', [DISABLED, {'plugins': upstream.PLUGINS, **DISABLED}, {'plugins': upstream.PLUGINS[:1]}]
)
def test_layers_that_are_not_enabled_or_not_listed_have_no_effect(given):
    laser = {'observation_sources': 'laser', 'laser': {'topic': '/scan', 'data_type': 'LaserScan'}}
    params = CostmapParams.from_mapping({'static_map': 'plugins' not in given, **given, **laser}, '')
    assert (params.static_map, params.observation_sources, params.inflation_radius) == (True, '', 0.0)


def test_the_laser_may_have_any_name():
    laser = {'topic': '/scan', 'data_type': 'LaserScan', 'clearing': False, 'obstacle_range': 1.5}
    params = CostmapParams.from_mapping({'observation_sources': 'front_laser', 'front_laser': laser}, '')
    assert (params.observation_sources, params.scan.clearing, params.obstacle_range) == ('scan', False, 1.5)


def test_the_robots_outline_is_read_as_upstream_does():
    """A round robot is a polygon of 16 corners, a footprint counts before the radius, and may be text."""
    params = CostmapParams.from_mapping({'robot_radius': 0.2}, '')
    assert len(params.footprint) == 16
    assert all(math.hypot(*corner) == pytest.approx(0.2) for corner in params.footprint)
    square = [[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]]
    assert CostmapParams.from_mapping({'robot_radius': 0.2, 'footprint': square}, '').footprint == square
    text = CostmapParams.from_mapping({'footprint': '[[0.2, 0.1], [-0.2, 0.1], [0, -0.3]]'}, '')
    assert text.footprint == [[0.2, 0.1], [-0.2, 0.1], [0.0, -0.3]]


@pytest.mark.parametrize(
    ('changes', 'can_start'),
    [
        ({}, False),  # 0.035 m/s and 0.2 rad/s after 50 ms
        ({'min_vel_trans': 0.03}, True),
        ({'acc_lim_x': 2.5, 'max_vel_x': 0.05}, False),
        ({'acc_lim_x': 2.5, 'max_vel_x': 0.05, 'min_vel_x': -0.2}, True),  # backwards
        ({'use_dwa': False}, True),  # sim_time is long enough
    ],
)
def test_a_standing_robot_starts_if_one_period_reaches_a_minimum(changes, can_start):
    slow_start = {'acc_lim_x': 0.7, 'acc_lim_theta': 4.0, 'min_vel_trans': 0.1, 'min_vel_theta': 0.4}
    assert DwaParams.from_mapping({**slow_start, **changes}, '').can_start(0.05) is can_start
