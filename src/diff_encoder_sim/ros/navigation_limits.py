"""Names and limits of move_base's parameters that can be changed while it runs, by upstream's .cfg file."""

from __future__ import annotations

import math
from typing import Dict

from diff_encoder_sim.ros.adjustable import RESTORE_DEFAULTS, Limits

NOT_NEGATIVE = (0.0, math.inf)
AT_LEAST_ONE = (1.0, math.inf)

MOVE_BASE: Dict[str, Limits] = {  # MoveBase.cfg
    'base_global_planner': None,
    'base_local_planner': None,
    'planner_frequency': (0, 100),
    'controller_frequency': (0, 100),
    'planner_patience': (0, 100),
    'controller_patience': (0, 100),
    'max_planning_retries': (-1, 1000),
    'conservative_reset_dist': (0, 50),
    'recovery_behavior_enabled': None,
    'clearing_rotation_allowed': None,
    'shutdown_costmaps': None,
    'oscillation_timeout': (0, 60),
    'oscillation_distance': (0, 10),
    'make_plan_clear_costmap': None,
    'make_plan_add_unreachable_goal': None,
    RESTORE_DEFAULTS: None,
}

DWA: Dict[str, Limits] = {  # DWAPlanner.cfg with local_planner_limits
    'max_vel_trans': NOT_NEGATIVE,
    'min_vel_trans': NOT_NEGATIVE,
    'max_vel_x': None,
    'min_vel_x': None,
    'max_vel_y': None,
    'min_vel_y': None,
    'max_vel_theta': NOT_NEGATIVE,
    'min_vel_theta': NOT_NEGATIVE,
    'acc_lim_x': (0, 20),
    'acc_lim_y': (0, 20),
    'acc_lim_theta': (0, 20),
    'acc_lim_trans': NOT_NEGATIVE,
    'prune_plan': None,
    'xy_goal_tolerance': None,
    'yaw_goal_tolerance': None,
    'trans_stopped_vel': None,
    'theta_stopped_vel': None,
    'sim_time': NOT_NEGATIVE,
    'sim_granularity': NOT_NEGATIVE,
    'angular_sim_granularity': NOT_NEGATIVE,
    'path_distance_bias': NOT_NEGATIVE,
    'goal_distance_bias': NOT_NEGATIVE,
    'occdist_scale': NOT_NEGATIVE,
    'twirling_scale': NOT_NEGATIVE,
    'stop_time_buffer': NOT_NEGATIVE,
    'oscillation_reset_dist': NOT_NEGATIVE,
    'oscillation_reset_angle': NOT_NEGATIVE,
    'forward_point_distance': None,
    'scaling_speed': NOT_NEGATIVE,
    'max_scaling_factor': NOT_NEGATIVE,
    'vx_samples': AT_LEAST_ONE,
    'vy_samples': AT_LEAST_ONE,
    'vth_samples': AT_LEAST_ONE,
    'use_dwa': None,
    RESTORE_DEFAULTS: None,
}

COSTMAP: Dict[str, Limits] = {  # Costmap2D.cfg, but for footprint and robot_radius
    'transform_tolerance': (0, 10),
    'update_frequency': (0, 100),
    'publish_frequency': (0, 100),
    'width': NOT_NEGATIVE,
    'height': NOT_NEGATIVE,
    'resolution': (0, 50),
    'origin_x': None,
    'origin_y': None,
    'footprint_padding': None,
}

OBSTACLE_LAYER: Dict[str, Limits] = {  # ObstaclePlugin.cfg, but for enabled
    'footprint_clearing_enabled': None,
    'max_obstacle_height': (0, 50),
    'combination_method': (0, 2),
}

INFLATION_LAYER: Dict[str, Limits] = {  # InflationPlugin.cfg, but for enabled
    'cost_scaling_factor': (0, 100),
    'inflation_radius': (0, 50),
    'inflate_unknown': None,
}
