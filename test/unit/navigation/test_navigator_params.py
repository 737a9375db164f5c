"""config/*.yaml against the parameters that upstream's navigation has on Noetic, both ways.

The tables were typed from ros-planning/navigation 1.17.3 (noetic-devel): names and defaults as the
nodes have them at start. Source files stand beside each.
"""

import math

import pytest
import yaml

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.typed_params import split_params
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.navigation.costmap_params import CostmapParams
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from places import CONFIG

# amcl/src/amcl_node.cpp, constructor and updatePoseFromServer; amcl/cfg/AMCL.cfg
AMCL = {
    'min_particles': 100,
    'max_particles': 5000,
    'kld_err': 0.01,
    'kld_z': 0.99,
    'update_min_d': 0.2,
    'update_min_a': math.pi / 6.0,
    'resample_interval': 2,
    'transform_tolerance': 0.1,
    'recovery_alpha_slow': 0.001,
    'recovery_alpha_fast': 0.1,
    'do_beamskip': False,
    'beam_skip_distance': 0.5,
    'beam_skip_threshold': 0.3,
    'beam_skip_error_threshold': 0.9,
    'tf_broadcast': True,
    'force_update_after_initialpose': False,
    'force_update_after_set_map': False,
    'gui_publish_rate': -1.0,
    'save_pose_rate': 0.5,
    'use_map_topic': False,
    'first_map_only': False,
    'selective_resampling': False,
    'laser_min_range': -1.0,
    'laser_max_range': -1.0,
    'laser_max_beams': 30,
    'laser_z_hit': 0.95,
    'laser_z_short': 0.1,
    'laser_z_max': 0.05,
    'laser_z_rand': 0.05,
    'laser_sigma_hit': 0.2,
    'laser_lambda_short': 0.1,
    'laser_likelihood_max_dist': 2.0,
    'laser_model_type': 'likelihood_field',
    'odom_model_type': 'diff',
    'odom_alpha1': 0.2,
    'odom_alpha2': 0.2,
    'odom_alpha3': 0.2,
    'odom_alpha4': 0.2,
    'odom_alpha5': 0.2,
    'odom_frame_id': 'odom',
    'base_frame_id': 'base_link',
    'global_frame_id': 'map',
    'initial_pose_x': 0.0,
    'initial_pose_y': 0.0,
    'initial_pose_a': 0.0,
    'initial_cov_xx': 0.25,
    'initial_cov_yy': 0.25,
    'initial_cov_aa': (math.pi / 12.0) ** 2,
    'std_warn_level_x': 0.2,
    'std_warn_level_y': 0.2,
    'std_warn_level_yaw': 0.1,
    'bag_scan_period': -1.0,
}

# move_base/src/move_base.cpp, constructor; base_local_planner/src/latched_stop_rotate_controller.cpp:
# dwa_planner_ros.h has one that is built without a name, so that it reads beside the others.
MOVE_BASE = {
    'base_global_planner': 'navfn/NavfnROS',
    'planner_frequency': 0.0,
    'controller_frequency': 20.0,
    'planner_patience': 5.0,
    'controller_patience': 15.0,
    'max_planning_retries': -1,
    'oscillation_timeout': 0.0,
    'oscillation_distance': 0.5,
    'make_plan_clear_costmap': True,
    'make_plan_add_unreachable_goal': True,
    'clearing_radius': 0.46,
    'conservative_reset_dist': 3.0,
    'shutdown_costmaps': False,
    'clearing_rotation_allowed': True,
    'recovery_behavior_enabled': True,
    'latch_xy_goal_tolerance': False,
    'restore_defaults': False,
}
# Another planner is upstream's default for this one.
MOVE_BASE_NAMES = {*MOVE_BASE, 'base_local_planner', 'recovery_behaviors'}

# navfn/src/navfn_ros.cpp, initialize
NAVFN = {
    'visualize_potential': False,
    'allow_unknown': True,
    'planner_window_x': 0.0,
    'planner_window_y': 0.0,
    'default_tolerance': 0.0,
}

# base_local_planner/src/local_planner_limits/__init__.py; dwa_local_planner/cfg/DWAPlanner.cfg;
# dwa_local_planner/src/dwa_planner.cpp and dwa_planner_ros.cpp
DWA = {
    'max_vel_trans': 0.55,
    'min_vel_trans': 0.1,
    'max_vel_x': 0.55,
    'min_vel_x': 0.0,
    'max_vel_y': 0.1,
    'min_vel_y': -0.1,
    'max_vel_theta': 1.0,
    'min_vel_theta': 0.4,
    'acc_lim_x': 2.5,
    'acc_lim_y': 2.5,
    'acc_lim_theta': 3.2,
    'acc_lim_trans': 0.1,
    'prune_plan': False,
    'xy_goal_tolerance': 0.1,
    'yaw_goal_tolerance': 0.1,
    'trans_stopped_vel': 0.1,
    'theta_stopped_vel': 0.1,
    'sim_time': 1.7,
    'sim_granularity': 0.025,
    'angular_sim_granularity': 0.1,
    'path_distance_bias': 0.6,
    'goal_distance_bias': 0.8,
    'occdist_scale': 0.01,
    'twirling_scale': 0.0,
    'stop_time_buffer': 0.2,
    'oscillation_reset_dist': 0.05,
    'oscillation_reset_angle': 0.2,
    'forward_point_distance': 0.325,
    'scaling_speed': 0.25,
    'max_scaling_factor': 0.2,
    'vx_samples': 3,
    'vy_samples': 10,
    'vth_samples': 20,
    'use_dwa': True,
    'restore_defaults': False,
    'sum_scores': False,
    'publish_cost_grid_pc': False,
    'publish_traj_pc': False,
    'global_frame_id': 'odom',
    'cheat_factor': 1.0,
    'odom_topic': 'odom',
}

# costmap_2d/src/costmap_2d_ros.cpp, constructor; costmap_2d/cfg/Costmap2D.cfg
COSTMAP = {
    'global_frame': 'map',
    'robot_base_frame': 'base_link',
    'rolling_window': False,
    'track_unknown_space': False,
    'always_send_full_costmap': False,
    'transform_tolerance': 0.3,
    'update_frequency': 5.0,
    'publish_frequency': 0.0,
    'width': 10,
    'height': 10,
    'resolution': 0.05,
    'origin_x': 0.0,
    'origin_y': 0.0,
    'footprint': '[]',
    'robot_radius': 0.46,
    'footprint_padding': 0.01,
}
# costmap_2d/plugins/*_layer.cpp, onInitialize; costmap_2d/cfg/{Generic,Obstacle,Inflation}Plugin.cfg
LAYERS = {
    'static_layer': {
        'enabled': True,
        'map_topic': 'map',
        'first_map_only': False,
        'subscribe_to_updates': False,
        'track_unknown_space': True,
        'use_maximum': False,
        'lethal_cost_threshold': 100,
        'unknown_cost_value': -1,
        'trinary_costmap': True,
    },
    'obstacle_layer': {
        'enabled': True,
        'track_unknown_space': False,
        'transform_tolerance': 0.2,
        'footprint_clearing_enabled': True,
        'max_obstacle_height': 2.0,
        'combination_method': 1,
        'observation_sources': 'scan',
        'obstacle_range': 2.5,
        'raytrace_range': 3.0,
    },
    'inflation_layer': {
        'enabled': True,
        'inflation_radius': 0.55,
        'cost_scaling_factor': 10.0,
        'inflate_unknown': False,
    },
}
SOURCE = {
    'topic': 'scan',
    'sensor_frame': '',
    'observation_persistence': 0.0,
    'expected_update_rate': 0.0,
    'data_type': 'PointCloud',
    'min_obstacle_height': 0.0,
    'max_obstacle_height': 2.0,
    'inf_is_valid': False,
    'clearing': False,
    'marking': True,
    'obstacle_range': 2.5,
    'raytrace_range': 3.0,
}
# costmap_2d/src/costmap_2d_ros.cpp, loadOldParameters: what moves from the costmap to its layers.
FLAT_NAMES = {
    'static_map',
    'map_type',
    'map_topic',
    'unknown_cost_value',
    'lethal_cost_threshold',
    'track_unknown_space',
    'max_obstacle_height',
    'raytrace_range',
    'obstacle_range',
    'observation_sources',
    'scan',
    'cost_scaling_factor',
    'inflation_radius',
}
FLAT = {key: value for layer in LAYERS.values() for key, value in layer.items() if key in FLAT_NAMES}

PLUGINS = [
    {'name': 'static_layer', 'type': 'costmap_2d::StaticLayer'},
    {'name': 'obstacle_layer', 'type': 'costmap_2d::ObstacleLayer'},
    {'name': 'inflation_layer', 'type': 'costmap_2d::InflationLayer'},
]

# What upstream does not know and ignores.
OWN_AMCL = {'seed', 'lost_fraction', 'lost_distance', 'lost_scans'}
OWN_MOVE_BASE = {'input_timeout', 'max_unseen_travel'}
OWN_DWA = {'twist_sigmas', 'latch_margin', 'turn_to_path_angle'}


def read(name):
    return yaml.safe_load((CONFIG / name).read_text())


# ---- our files, read by upstream


def test_upstream_knows_every_parameter_of_our_amcl_yaml():
    assert set(read('amcl.yaml')) - set(AMCL) <= OWN_AMCL


def test_upstream_knows_every_parameter_of_our_navigation_yaml():
    ours = read('navigation.yaml')
    parts = {'global_costmap', 'local_costmap', 'NavfnROS', 'DWAPlannerROS'}
    assert set(ours) - MOVE_BASE_NAMES - parts <= OWN_MOVE_BASE
    assert set(ours['DWAPlannerROS']) - set(DWA) <= OWN_DWA
    assert set(ours.get('NavfnROS', {})) <= set(NAVFN)
    for costmap in (ours['global_costmap'], ours['local_costmap']):
        assert set(costmap) <= set(COSTMAP) | FLAT_NAMES
        assert set(costmap['scan']) <= set(SOURCE)


@pytest.mark.parametrize(
    ('name', 'tables'), [('amcl.yaml', (AMCL,)), ('navigation.yaml', (MOVE_BASE, DWA, COSTMAP, SOURCE, FLAT))]
)
def test_values_have_the_type_that_upstream_reads(name, tables):
    """roscpp reads a whole number as a float and rounds a float, but takes no text or flag for one."""
    for key, value in leaves(read(name)):
        for default in (table[key] for table in tables if key in table and key != 'footprint'):
            kinds = (int, float) if type(default) in (int, float) else (type(default),)
            assert type(value) in kinds, key


def leaves(mapping):
    for key, value in mapping.items():
        if isinstance(value, dict):
            yield from leaves(value)
        else:
            yield key, value


def test_what_our_files_leave_out_is_the_same_in_both_stacks():
    """A default that differs must stand in the file."""
    amcl, ours = read('amcl.yaml'), read('navigation.yaml')
    assert different(AMCL, AmclParams(), amcl) == set()
    params = NavigatorParams.from_mapping({}, '')
    assert different(MOVE_BASE, params, ours) == set()
    assert different(NAVFN, params.NavfnROS, ours.get('NavfnROS', {})) == set()
    assert different(DWA, params.DWAPlannerROS, ours['DWAPlannerROS']) == set()
    # The size of the global one is the map's.
    for name, costmap, other in (
        ('global_costmap', CostmapParams(), {'width', 'height'}),
        ('local_costmap', params.local_costmap, set()),
    ):
        upstream = {**COSTMAP, **FLAT, 'static_map': False}
        assert different(upstream, costmap, ours[name]) <= other
        assert different(SOURCE, costmap.scan, ours[name]['scan']) <= {'obstacle_range', 'raytrace_range'}


def different(upstream, params, given):
    """Names that are not given and whose defaults differ. A robot_radius is read as a footprint."""
    return {
        key
        for key, value in upstream.items()
        if key not in given and key != 'robot_radius' and getattr(params, key, None) != value
    }


def test_our_file_means_the_same_to_the_embedded_stack():
    params = NavigatorParams.from_mapping(read('navigation.yaml'), 'navigation.yaml')
    assert params.DWAPlannerROS.latch_xy_goal_tolerance
    assert params.global_costmap.observation_sources == 'scan'
    assert params.local_costmap.scan.clearing


# ---- upstream's files, read by us


def test_amcl_takes_every_parameter_of_upstream_at_its_default():
    assert AmclParams.from_mapping(AMCL, 'amcl') == AmclParams()


def test_amcl_takes_what_upstreams_node_writes_to_the_parameter_server():
    """dynamic_reconfigure adds restore_defaults, and has an older name for one of the others."""
    older = 'beam_skip_error_threshold_'
    dumped = {**AMCL, 'restore_defaults': False, older: 0.0}
    assert AmclParams.from_mapping(dumped, 'amcl') == AmclParams(beam_skip_error_threshold=0.0)
    with pytest.raises(ConfigError, match='beam_skip_error_threshold: given 1.5'):
        AmclParams.from_mapping({older: 1.5}, 'amcl')
    # What has no effect leaves the campaigns' fingerprints as they are.
    assert not {older, 'restore_defaults'} & set(AmclParams().model_dump())


def navigation(**changes):
    """Upstream's whole tree, its own way, for this planner and a laser."""
    source = {**SOURCE, 'data_type': 'LaserScan'}
    layers = {**LAYERS, 'obstacle_layer': {**LAYERS['obstacle_layer'], 'scan': source}}
    return {
        **MOVE_BASE,
        'base_local_planner': 'dwa_local_planner/DWAPlannerROS',
        'NavfnROS': NAVFN,
        'DWAPlannerROS': DWA,
        'global_costmap': {**COSTMAP, **layers, 'plugins': PLUGINS},
        'local_costmap': {
            **COSTMAP,
            'obstacle_layer': layers['obstacle_layer'],
            'inflation_layer': layers['inflation_layer'],
            'global_frame': 'odom',
            'rolling_window': True,
            'plugins': PLUGINS[1:],
        },
        **changes,
    }


def test_the_navigator_takes_every_parameter_of_upstream_at_its_default():
    (params,) = split_params(navigation(), 'move_base', NavigatorParams)  # as the node does
    assert params.global_costmap.static_map and not params.local_costmap.static_map
    assert params.DWAPlannerROS.goal_distance_bias == 0.8
    for costmap in (params.global_costmap, params.local_costmap):
        assert (costmap.obstacle_range, costmap.raytrace_range) == (2.5, 3.0)
        assert costmap.transform_tolerance == 0.3  # not the obstacle layer's
        assert not costmap.scan.clearing  # as upstream: it must be told to clear
        assert not costmap.track_unknown_space  # the costmap's counts before a layer's


def test_the_flat_form_is_the_layered_one():
    source = {**SOURCE, 'data_type': 'LaserScan'}
    flat = {**COSTMAP, **FLAT, 'static_map': True, 'map_type': 'costmap', 'scan': source}
    layered = navigation()['global_costmap']
    assert CostmapParams.from_mapping(flat, '') == CostmapParams.from_mapping(layered, '')


def test_what_the_costmap_says_goes_before_what_the_layer_says():
    layered = {**navigation()['global_costmap'], 'inflation_radius': 0.8}
    assert CostmapParams.from_mapping(layered, '').inflation_radius == 0.8


def test_layers_count_without_a_list_of_plugins():
    params = CostmapParams.from_mapping({'inflation_layer': {'inflation_radius': 0.7}}, '')
    assert params.inflation_radius == 0.7


def test_layers_that_are_not_listed_are_not_there():
    params = CostmapParams.from_mapping({'plugins': PLUGINS[:1], 'static_map': False}, '')
    assert (params.static_map, params.observation_sources, params.inflation_radius) == (True, '', 0.0)


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


REFUSED = {
    'another layer': (
        {'plugins': [{'name': 'v', 'type': 'costmap_2d::VoxelLayer'}]},
        'costmap_2d::StaticLayer, costmap_2d::ObstacleLayer',
    ),
    'order': ({'plugins': PLUGINS[::-1]}, 'in this order'),
    'no list': ({'plugins': 'static_layer'}, 'a list of'),
    'layer is no mapping': ({'plugins': PLUGINS, 'static_layer': 3}, 'static_layer: a mapping'),
    'switched off': ({'plugins': PLUGINS, 'inflation_layer': {'enabled': False}}, 'inflation_layer.enabled: true'),
    'misspelt in a layer': (
        {'plugins': PLUGINS, 'inflation_layer': {'inflation_radios': 0.5}},
        'inflation_radios: unknown key',
    ),
    'voxels': ({'map_type': 'voxel'}, "map_type: given 'voxel'; allowed: 'costmap'"),
    'two lasers': ({'observation_sources': 'front rear'}, 'one laser, not 2'),
    'points': ({'scan': {'data_type': 'PointCloud2'}}, "scan.data_type: given 'PointCloud2'"),
    'another topic': ({'scan': {'topic': '/base_scan'}}, 'remap'),
    'topic by the source': ({'observation_sources': 'laser', 'laser': {}}, "given 'laser'"),
    'maximum': ({'use_maximum': True}, 'use_maximum: given True; allowed: False'),
    'too fine': ({'plugins': PLUGINS[1:], 'rolling_window': True, 'resolution': 1e-4}, '25000000 cells'),
    'radius': ({'robot_radius': -0.2}, 'robot_radius: greater than 0, not -0.2'),
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


@pytest.mark.parametrize(
    ('given', 'complaint'),
    [
        (
            {'base_local_planner': 'teb_local_planner/TebLocalPlannerROS'},
            "base_local_planner: given 'teb_local_planner/TebLocalPlannerROS'; allowed: "
            "'dwa_local_planner/DWAPlannerROS'",
        ),
        ({'base_global_planner': 'global_planner/GlobalPlanner'}, "allowed: 'navfn/NavfnROS'"),
        # Upstream's default is map: the robot would take its odometry for where it is on the map.
        ({'local_costmap': {'rolling_window': True}}, "local_costmap.global_frame that is /odom's"),
        ({'local_costmap': {'rolling_window': True, 'global_frame': '/map'}}, 'and not global_costmap'),
    ],
)
def test_what_the_navigator_cannot_do_is_named_in_one_line(given, complaint):
    with pytest.raises(ConfigError) as caught:
        NavigatorParams.from_mapping(given, '/move_base')
    assert complaint in str(caught.value) and '\n' not in str(caught.value)


def test_a_rolling_window_needs_no_static_map_to_be_switched_off():
    params = NavigatorParams.from_mapping({'local_costmap': {'rolling_window': True, 'global_frame': 'odom'}}, '')
    assert (params.local_costmap.static_map, params.local_costmap.track_unknown_space) == (False, False)


@pytest.mark.parametrize(
    ('listed', 'complaint'),
    [
        ([{'name': 'a', 'type': 'move_slow_and_clear/MoveSlowAndClear'}], 'MoveSlowAndClear'),
        ([{'name': 'a'}], 'type'),
        ([{'type': 'rotate_recovery/RotateRecovery'}], 'name'),
        (2 * [{'name': 'a', 'type': 'rotate_recovery/RotateRecovery'}], 'a name of its own'),
    ],
)
def test_recovery_behaviours_that_there_are_not(listed, complaint):
    with pytest.raises(ConfigError, match='recovery_behaviors') as caught:
        NavigatorParams.from_mapping(navigation(recovery_behaviors=listed), '')
    assert complaint in str(caught.value)


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
