"""Parameters that upstream's navigation has on Noetic, with their defaults.

Typed from ros-planning/navigation 1.17.3 (noetic-devel): names and defaults as the nodes have them at start. Source
files stand beside each table.
"""

import math

import yaml

from places import CONFIG

# amcl/src/amcl_node.cpp, constructor and updatePoseFromServer; amcl/cfg/AMCL.cfg
AMCL = yaml.safe_load("""
{min_particles: 100, max_particles: 5000, kld_err: 0.01, kld_z: 0.99, update_min_d: 0.2, resample_interval: 2,
  transform_tolerance: 0.1, recovery_alpha_slow: 0.001, recovery_alpha_fast: 0.1, do_beamskip: false,
  beam_skip_distance: 0.5, beam_skip_threshold: 0.3, beam_skip_error_threshold: 0.9, tf_broadcast: true,
  force_update_after_initialpose: false, force_update_after_set_map: false, gui_publish_rate: -1.0, save_pose_rate:
  0.5, use_map_topic: false, first_map_only: false, selective_resampling: false, laser_min_range: -1.0,
  laser_max_range: -1.0, laser_max_beams: 30, laser_z_hit: 0.95, laser_z_short: 0.1, laser_z_max: 0.05,
  laser_z_rand: 0.05, laser_sigma_hit: 0.2, laser_lambda_short: 0.1, laser_likelihood_max_dist: 2.0,
  laser_model_type: likelihood_field, odom_model_type: diff, odom_alpha1: 0.2, odom_alpha2: 0.2, odom_alpha3: 0.2,
  odom_alpha4: 0.2, odom_alpha5: 0.2, odom_frame_id: odom, base_frame_id: base_link, global_frame_id: map,
  initial_pose_x: 0.0, initial_pose_y: 0.0, initial_pose_a: 0.0, initial_cov_xx: 0.25, initial_cov_yy: 0.25,
  std_warn_level_x: 0.2, std_warn_level_y: 0.2, std_warn_level_yaw: 0.1, bag_scan_period: -1.0}
""")
AMCL.update(update_min_a=math.pi / 6.0, initial_cov_aa=(math.pi / 12.0) ** 2)

# move_base/src/move_base.cpp, constructor; base_local_planner/src/latched_stop_rotate_controller.cpp:
# dwa_planner_ros.h has one that is built without a name, so that it reads beside the others.
MOVE_BASE = yaml.safe_load("""
{base_global_planner: navfn/NavfnROS, planner_frequency: 0.0, controller_frequency: 20.0, planner_patience: 5.0,
  controller_patience: 15.0, max_planning_retries: -1, oscillation_timeout: 0.0, oscillation_distance: 0.5,
  make_plan_clear_costmap: true, make_plan_add_unreachable_goal: true, clearing_radius: 0.46,
  conservative_reset_dist: 3.0, shutdown_costmaps: false, clearing_rotation_allowed: true,
  recovery_behavior_enabled: true, latch_xy_goal_tolerance: false, restore_defaults: false}
""")

# Another planner is upstream's default for this one.
MOVE_BASE_NAMES = {*MOVE_BASE, 'base_local_planner', 'recovery_behaviors'}

# navfn/src/navfn_ros.cpp, initialize
NAVFN = yaml.safe_load("""
{visualize_potential: false, allow_unknown: true, planner_window_x: 0.0, planner_window_y: 0.0, default_tolerance:
  0.0}
""")

# base_local_planner/src/local_planner_limits/__init__.py; dwa_local_planner/cfg/DWAPlanner.cfg;
# dwa_local_planner/src/dwa_planner.cpp and dwa_planner_ros.cpp
DWA = yaml.safe_load("""
{max_vel_trans: 0.55, min_vel_trans: 0.1, max_vel_x: 0.55, min_vel_x: 0.0, max_vel_y: 0.1, min_vel_y: -0.1,
  max_vel_theta: 1.0, min_vel_theta: 0.4, acc_lim_x: 2.5, acc_lim_y: 2.5, acc_lim_theta: 3.2, acc_lim_trans: 0.1,
  prune_plan: false, xy_goal_tolerance: 0.1, yaw_goal_tolerance: 0.1, trans_stopped_vel: 0.1, theta_stopped_vel:
  0.1, sim_time: 1.7, sim_granularity: 0.025, angular_sim_granularity: 0.1, path_distance_bias: 0.6,
  goal_distance_bias: 0.8, occdist_scale: 0.01, twirling_scale: 0.0, stop_time_buffer: 0.2, oscillation_reset_dist:
  0.05, oscillation_reset_angle: 0.2, forward_point_distance: 0.325, scaling_speed: 0.25, max_scaling_factor: 0.2,
  vx_samples: 3, vy_samples: 10, vth_samples: 20, use_dwa: true, restore_defaults: false, sum_scores: false,
  publish_cost_grid_pc: false, publish_traj_pc: false, global_frame_id: odom, cheat_factor: 1.0, odom_topic: odom}
""")

# costmap_2d/src/costmap_2d_ros.cpp, constructor; costmap_2d/cfg/Costmap2D.cfg
COSTMAP = yaml.safe_load("""
{global_frame: map, robot_base_frame: base_link, rolling_window: false, track_unknown_space: false,
  always_send_full_costmap: false, transform_tolerance: 0.3, update_frequency: 5.0, publish_frequency: 0.0, width:
  10, height: 10, resolution: 0.05, origin_x: 0.0, origin_y: 0.0, footprint: '[]', robot_radius: 0.46,
  footprint_padding: 0.01}
""")

# costmap_2d/plugins/*_layer.cpp, onInitialize; costmap_2d/cfg/{Generic,Obstacle,Inflation}Plugin.cfg
LAYERS = yaml.safe_load("""
{static_layer: {enabled: true, map_topic: map, first_map_only: false, subscribe_to_updates: false,
  track_unknown_space: true, use_maximum: false, lethal_cost_threshold: 100, unknown_cost_value: -1,
  trinary_costmap: true}, obstacle_layer: { enabled: true, track_unknown_space: false, transform_tolerance: 0.2,
  footprint_clearing_enabled: true, max_obstacle_height: 2.0, combination_method: 1, observation_sources: scan,
  obstacle_range: 2.5, raytrace_range: 3.0}, inflation_layer: { enabled: true, inflation_radius: 0.55,
  cost_scaling_factor: 10.0, inflate_unknown: false}}
""")

SCAN_SOURCE = yaml.safe_load("""
{topic: scan, sensor_frame: '', observation_persistence: 0.0, expected_update_rate: 0.0, data_type: PointCloud,
  min_obstacle_height: 0.0, max_obstacle_height: 2.0, inf_is_valid: false, clearing: false, marking: true,
  obstacle_range: 2.5, raytrace_range: 3.0}
""")

# costmap_2d/src/costmap_2d_ros.cpp, loadOldParameters: what moves from the costmap to its layers.
FLAT_NAMES = set(
    yaml.safe_load("""
[cost_scaling_factor, inflation_radius, lethal_cost_threshold, map_topic, map_type, max_obstacle_height,
  observation_sources, obstacle_range, raytrace_range, scan, static_map, track_unknown_space, unknown_cost_value]
""")
)
FLAT = {key: value for layer in LAYERS.values() for key, value in layer.items() if key in FLAT_NAMES}
PLUGINS = yaml.safe_load("""
[{name: static_layer, type: 'costmap_2d::StaticLayer'}, {name: obstacle_layer, type: 'costmap_2d::ObstacleLayer'},
  {name: inflation_layer, type: 'costmap_2d::InflationLayer'}]
""")


def read_config(name):
    return yaml.safe_load((CONFIG / name).read_text())


def wrong_types(given, tables):
    """Return the keys of a tree of parameters whose values do not have the type of upstream's default.

    roscpp reads a whole number as a float and rounds a float, but takes no text or flag for one.
    """
    wrong = []
    for key, value in given.items():
        if isinstance(value, dict):
            wrong += wrong_types(value, tables)
            continue
        for default in (table[key] for table in tables if key in table and key != 'footprint'):
            kinds = (int, float) if type(default) in (int, float) else (type(default),)
            wrong += [] if type(value) in kinds else [key]
    return wrong


def different(upstream, params, given):
    """Return the names that are not given and whose defaults differ. A robot_radius is read as a footprint."""
    return {
        key
        for key, value in upstream.items()
        if key not in given and key != 'robot_radius' and getattr(params, key, None) != value
    }


def upstream_navigation():
    """Return upstream's whole tree of parameters, in its own form, for this planner and a laser."""
    source = {**SCAN_SOURCE, 'data_type': 'LaserScan'}
    layers = {**LAYERS, 'obstacle_layer': {**LAYERS['obstacle_layer'], 'scan': source}}
    window = {key: layer for key, layer in layers.items() if key != 'static_layer'}
    in_odom = {'global_frame': 'odom', 'rolling_window': True, 'plugins': PLUGINS[1:]}
    return {
        **MOVE_BASE,
        'base_local_planner': 'dwa_local_planner/DWAPlannerROS',
        'NavfnROS': NAVFN,
        'DWAPlannerROS': DWA,
        'global_costmap': {**COSTMAP, **layers, 'plugins': PLUGINS},
        'local_costmap': {**COSTMAP, **window, **in_odom},
    }
