"""The settings that follow from a robot's description, by dotted keys as a robot file's `set` has them."""

from __future__ import annotations

from typing import Any, Dict, Mapping

from diff_encoder_sim.robots.robot_description import RobotDescription

# Values of config/navigation.yaml and config/amcl.yaml, which hold unless the robot is slower or sees less.
_USUAL_LIMITS = {
    'navigation.DWAPlannerROS.max_vel_x': ('max_linear_speed', 0.45),
    'navigation.DWAPlannerROS.max_vel_trans': ('max_linear_speed', 0.45),
    'navigation.DWAPlannerROS.max_vel_theta': ('max_angular_speed', 1.0),
    'navigation.DWAPlannerROS.min_vel_theta': ('max_angular_speed', 0.2),
    'navigation.DWAPlannerROS.acc_lim_x': ('max_linear_acceleration', 0.7),
    'navigation.DWAPlannerROS.acc_lim_theta': ('max_angular_acceleration', 4.9),
}
_LASER_MAX_RANGE_M = 3.5
_DIGITS = 6


def derived_settings(robot: RobotDescription) -> Dict[str, Any]:
    """Return settings by dotted keys that begin with the stem of a file of config/.

    A robot file's own values go before these.
    """
    return {
        **_wheels(robot),
        **_frames(robot),
        **_laser(robot),
        **{f'simulator.drive.{key}': _rounded(value) for key, value in robot.drive_limits.items()},
        **_navigation(robot.drive_limits),
        **_footprint(robot),
    }


def _wheels(robot: RobotDescription) -> Dict[str, Any]:
    settings: Dict[str, Any] = {
        'config.wheel_diameter': _rounded(robot.wheel_diameter_m),
        'config.wheel_separation': _rounded(robot.wheel_separation_m),
        'config.axle_x': _rounded(robot.axle_x_m),
        'amcl.axle_x': _rounded(robot.axle_x_m),
        # The simulated ones too: workers have the URDF alone, not the controller's file that may have them.
        'simulator.wheel_diameter': _rounded(robot.wheel_diameter_m),
        'simulator.wheel_separation': _rounded(robot.wheel_separation_m),
    }
    for side, wheel in (('left', robot.left), ('right', robot.right)):
        settings[f'config.{side}_joint'] = wheel.joint
        settings[f'config.{side}_reversed'] = not wheel.is_forward_positive
        settings[f'simulator.{side}_joint'] = wheel.joint
    return settings


def _frames(robot: RobotDescription) -> Dict[str, Any]:
    keys = (
        'config.base_frame',
        'amcl.base_frame_id',
        *(f'navigation.{map_}_costmap.robot_base_frame' for map_ in ('global', 'local')),
    )
    return dict.fromkeys(keys, robot.tree.root)


def _laser(robot: RobotDescription) -> Dict[str, Any]:
    if robot.laser is None:
        return {}
    settings = {f'simulator.lidar.{key}': value for key, value in robot.laser.settings.items()}
    range_max_m = robot.laser.settings.get('range_max')
    if range_max_m is not None:
        settings['amcl.laser_max_range'] = min(_LASER_MAX_RANGE_M, range_max_m)
    return {'simulator.laser_link': robot.laser.link, **settings}


def _navigation(limits: Mapping[str, float]) -> Dict[str, Any]:
    """Return what the navigator may ask of the drive: not more than its limits."""
    return {
        key: _rounded(min(usual, limits[limit])) for key, (limit, usual) in _USUAL_LIMITS.items() if limit in limits
    }


def _footprint(robot: RobotDescription) -> Dict[str, Any]:
    corners = [[_rounded(x_m), _rounded(y_m)] for x_m, y_m in robot.footprint]
    return {f'navigation.{map_}_costmap.footprint': corners for map_ in ('global', 'local')}


def _rounded(value: float) -> float:
    """Return a number as a person would write it: 0.066 for 0.06600000000000002."""
    return float(f'{round(value, 9):.{_DIGITS}g}') + 0.0
