"""YAML for other ROS packages: diff_drive_controller, robot_localization and AMCL of ROS 1, and of ROS 2 with Nav2.

The names are those of the packages' documentation (test/unit/wheels/documented_parameters.yaml); every value follows
from the geometry, the encoder and the slip of the odometry's parameters.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

import yaml

from diff_encoder_sim.base.atomic_files import write_file
from diff_encoder_sim.base.rounding import rounded
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.wheels.covariance import (
    NO_ERRORS,
    PlanarCovariance,
    carry_geometry_errors,
    geometry_covariance,
    propagate_motion_noise,
    quantisation_covariance,
    reading_variance,
)
from diff_encoder_sim.wheels.odometry_params import USUAL_MOTION_NOISE, OdometryParams

RATE_HZ, WINDOW = 50.0, 10  # publish_rate and velocity_rolling_window_size: defaults of diff_drive_controller
SPEED_MPS, TURN_RADPS = 0.5, 0.5  # of the twist's covariance
DISTANCE_M, ROTATION_RAD = 10.0, 2.0 * math.pi  # of the pose's covariance; after which AMCL covers geometry errors
AMCLS = {  # prefix of the alphas, motion model, default update_min_d [m] and update_min_a [rad]
    'ROS 1': ('odom_', ('odom_model_type', 'diff-corrected'), 0.2, round(math.pi / 6.0, 4)),
    'ROS 2': ('', ('robot_model_type', 'nav2_amcl::DifferentialMotionModel'), 0.25, 0.2),
}
LEAST_VARIANCE = 1e-9  # robot_localization replaces 0 by 1e-6
NOT_MEASURED = 1e6  # variance of z, roll and pitch
LARGEST_ALPHA = 1000.0
COLUMNS = 100
STEPS = 50  # of a straight line

Entries = List[Tuple[str, Any, str]]  # key, value, comment
FUSED = [index in (6, 7, 11) for index in range(15)]
EKF: Entries = [
    ('two_d_mode', True, 'level floor'),
    ('odom0', '/diff_drive_controller/odom', 'with enable_odom_tf: false there: only one may publish TF'),
    ('odom0_config', FUSED, 'vx, vy (0) and vyaw; their covariance is twist_covariance_diagonal'),
    ('odom0_differential', False, 'no pose is fused: it is the integral of the same velocities'),
    ('odom0_relative', False, 'likewise'),
]


class RosWheels(NamedTuple):
    """Wheels, encoder and slip of a robot."""

    odometry: OdometryParams
    about: str  # source of the values, in one line
    nominal_m: Optional[Tuple[float, float, float]] = None  # left and right diameter, separation; None: as `odometry`
    turn_noise: float = 0.0  # extra variance of the heading per radian turned [rad^2/rad]
    measured: Optional[Tuple[Sequence[float], str]] = None  # variances of x [m^2], y and yaw [rad^2]; the measurement

    @property
    def slip(self) -> float:
        """Return the variance of a wheel's travel per metre [m^2/m]; the usual one if no slip is known."""
        return self.odometry.travel_variance or USUAL_MOTION_NOISE


class RosParameters(NamedTuple):
    """Values by name, and the text of YAML files."""

    diff_drive_controller: Dict[str, Any]
    ros1: str
    ros2: str

    def write(self, folder: Path, prefix: str = '') -> List[Path]:
        """Write ros1.yaml and ros2.yaml into a folder, with a prefix in their names; return their paths."""
        texts = {folder / f'{prefix}ros1.yaml': self.ros1, folder / f'{prefix}ros2.yaml': self.ros2}
        for path, text in texts.items():
            write_file(path, f'{text}\n'.encode())
        return [*texts]


def ros_parameters(wheels: RosWheels) -> RosParameters:
    """Return the parameters of all packages."""
    controller = _controller(wheels)
    kind = 'slip' if wheels.odometry.motion_noise else 'usual slip'
    about = f'{wheels.about}; {kind} of a wheel, {1e3 * math.sqrt(wheels.slip):.2g} mm after 1 m'
    rest = '# Use the names of your nodes, and keep their other parameters (wheel joints, frames, limits).'
    texts = []
    for version, ekf_node in (('ROS 1', 'ekf_localization_node'), ('ROS 2', 'ekf_filter_node')):
        nodes = {'diff_drive_controller': controller, ekf_node: EKF, 'amcl': _amcl(wheels, version)}
        sections = [_section(node, entries, version == 'ROS 2') for node, entries in nodes.items()]
        texts.append('\n'.join([f'# {version}: {about}', rest, *sections]))
    return RosParameters({key: value for key, value, _ in controller}, *texts)


def _section(node: str, entries: Entries, is_ros2: bool) -> str:
    """Return a node's parameters as YAML; a comment is above a line that would be too long with it."""
    indent, lines = '    ' if is_ros2 else '  ', [f'{node}:', *(['  ros__parameters:'] if is_ros2 else [])]
    for key, value, comment in entries:
        text = yaml.safe_dump(value, default_flow_style=True, width=math.inf).partition('\n')[0]
        if isinstance(value, list) and len(value) > 6:  # three in a line, as in robot_localization's documentation
            parts = text.strip('[]').split(', ')
            rows = [', '.join(parts[row : row + 3]) for row in range(0, len(parts), 3)]
            text = '[' + f',\n{indent}{" " * (len(key) + 3)}'.join(rows) + ']'
        line = f'{indent}{key}: {text}'
        is_short = '\n' not in line and len(line) + len(comment) + 4 <= COLUMNS
        lines += [f'{line}  # {comment}'] if is_short else [f'{indent}# {comment}', line]
    return '\n'.join(lines)


def _controller(wheels: RosWheels) -> Entries:
    odometry = wheels.odometry
    own = odometry.wheel_diameter.left, odometry.wheel_diameter.right, odometry.wheel_separation
    left_m, right_m, separation_m = wheels.nominal_m or own
    diameter_m = 0.5 * (left_m + right_m)
    of_nominal = 'nominal' if wheels.nominal_m else 'of odometry'
    pose, after = wheels.measured or (pose_variances(wheels), f'a straight line of {DISTANCE_M:g} m')
    linear, angular = twist_variances(wheels)
    return [
        ('wheel_separation', rounded(separation_m, 7), f'm, {of_nominal}'),
        ('wheel_radius', rounded(0.5 * diameter_m, 7), f'm, {of_nominal}, mean of both wheels'),
        ('wheel_separation_multiplier', rounded(own[2] / separation_m, 7), 'separation / wheel_separation'),
        ('left_wheel_radius_multiplier', rounded(own[0] / diameter_m, 7), 'radius of the left wheel / wheel_radius'),
        ('right_wheel_radius_multiplier', rounded(own[1] / diameter_m, 7), 'radius of the right wheel / wheel_radius'),
        ('publish_rate', RATE_HZ, 'Hz, for which the covariance of the twist holds'),
        ('velocity_rolling_window_size', WINDOW, f'updates of the controller, at {RATE_HZ:g} Hz'),
        (
            'pose_covariance_diagonal',
            _diagonal(*pose),
            f'x y z roll pitch yaw [m^2, rad^2] after {after}; z, roll, pitch: not measured',
        ),
        (
            'twist_covariance_diagonal',
            _diagonal(linear, linear, angular),  # no speed sideways is as certain
            f'counts in {WINDOW / RATE_HZ:g} s, slip and geometry at {SPEED_MPS:g} m/s and {TURN_RADPS:g} rad/s',
        ),
    ]


def _amcl(wheels: RosWheels, version: str) -> Entries:
    prefix, model, line_m, turn_rad = AMCLS[version]
    alphas = amcl_alphas(wheels, line_m, turn_rad)
    return [
        (*model, 'alphas of variances; least ones, which cover odometry only'),
        (f'{prefix}alpha1', alphas['alpha1'], 'rotation from rotation: slip, counts; geometry over a full turn'),
        (f'{prefix}alpha2', alphas['alpha2'], f'rotation from translation: likewise; geometry over {DISTANCE_M:g} m'),
        (f'{prefix}alpha3', alphas['alpha3'], 'translation from translation: likewise'),
        (f'{prefix}alpha4', alphas['alpha4'], 'translation from rotation: likewise'),
        (f'{prefix}alpha5', 0.2, 'without effect: of the omni models'),
        ('update_min_d', line_m, 'm, default; the alphas hold for these steps'),
        ('update_min_a', turn_rad, 'rad, default'),
    ]


def amcl_alphas(wheels: RosWheels, line_m: float, turn_rad: float, is_corrected: bool = True) -> Dict[str, float]:
    """Return alpha1 to alpha4 with which AMCL spreads its particles as slip, counts and geometry spread the robot.

    AMCL moves its particles after a straight line of `line_m` (update_min_d) or a turn of `turn_rad` (update_min_a),
    for which this is exact. The variance of a wheel's travel is that of its slip and of a reading at both ends. Errors
    of the geometry are constant, but AMCL samples each step independently: the steps add up to their variance after
    `DISTANCE_M` or `ROTATION_RAD`, and to more before it. Alpha1 is of the heading after a turn, alpha2 after a line
    (half of it in each of two noisy rotations); alpha3 and alpha4 are of the distance after a line and a turn. If
    `is_corrected` (`diff-corrected`, Nav2), alpha times the squared line or turn is a variance, else a standard
    deviation (`diff`).
    """
    separation_m, std = wheels.odometry.wheel_separation, wheels.odometry.geometry_std
    reading_m2 = sum(wheels.odometry.reading_variances_m2)  # of a wheel's travel, at both ends: mean of both wheels
    line_m2, turn_m2 = (wheels.slip * way_m + reading_m2 for way_m in (line_m, 0.5 * turn_rad * separation_m))
    lines_m2, turns_rad2 = line_m * DISTANCE_M, turn_rad * ROTATION_RAD
    variances = {
        'alpha1': (2.0 * turn_m2 / separation_m**2 + wheels.turn_noise * turn_rad + std.turn**2 * turns_rad2, turn_rad),
        'alpha2': ((line_m2 + 0.5 * std.diameter_difference**2 * lines_m2) / separation_m**2, line_m),
        'alpha3': (0.5 * line_m2 + std.distance**2 * lines_m2, line_m),
        'alpha4': (0.5 * turn_m2 + (0.25 * separation_m * std.diameter_difference) ** 2 * turns_rad2, turn_rad),
    }
    power = 1.0 if is_corrected else 0.5
    alphas = {name: variance**power / move**2 for name, (variance, move) in variances.items()}
    return {name: rounded(min(alpha, LARGEST_ALPHA), 4) for name, alpha in alphas.items()}


def twist_variances(wheels: RosWheels) -> Tuple[float, float]:
    """Return the variances of the linear [m^2/s^2] and angular [rad^2/s^2] speed that diff_drive_controller publishes.

    It is the mean over `WINDOW` updates, with a reading of the encoder at both ends. Slip is that of white noise at
    `RATE_HZ`, which adds up to the slip of the whole drive in a filter that fuses every message.
    """
    odometry, separation_m, window_s = wheels.odometry, wheels.odometry.wheel_separation, WINDOW / RATE_HZ
    encoder, std, both = odometry.encoder, odometry.geometry_std, 0.0
    for sign, m_per_pulse in zip((-1.0, 1.0), odometry.m_per_pulse):
        speed_mps = abs(SPEED_MPS + sign * 0.5 * separation_m * TURN_RADPS)
        both += 2.0 * reading_variance(m_per_pulse, encoder.edge_variance) / window_s**2
        both += encoder.speed_variance * speed_mps**2 + wheels.slip * speed_mps * RATE_HZ
    angular = both / separation_m**2 + wheels.turn_noise * TURN_RADPS * RATE_HZ + (std.turn * TURN_RADPS) ** 2
    angular += (std.diameter_difference * SPEED_MPS / separation_m) ** 2
    return 0.25 * both + (std.distance * SPEED_MPS) ** 2, angular


def pose_variances(wheels: RosWheels) -> Tuple[float, float, float]:
    """Return the variances of x, y [m^2] and yaw [rad^2] that /odom of this package states after `DISTANCE_M`."""
    odometry, separation_m, step_m = wheels.odometry, wheels.odometry.wheel_separation, DISTANCE_M / STEPS
    covariance, errors = PlanarCovariance(), NO_ERRORS
    for _ in range(STEPS):
        covariance = propagate_motion_noise(covariance, 0.0, step_m, step_m, separation_m, wheels.slip)
        errors = carry_geometry_errors(errors, 0.0, step_m, step_m, separation_m)
    end = Pose2D(DISTANCE_M, 0.0, 0.0)
    covariance = covariance.plus(quantisation_covariance(end, odometry.reading_variances_m2, separation_m))
    covariance = covariance.plus(geometry_covariance(errors, odometry.geometry_std))
    return covariance.xx, covariance.yy, covariance.yaw_yaw


def _diagonal(x: float, y: float, yaw: float) -> List[float]:
    x, y, yaw = (rounded(max(variance, LEAST_VARIANCE), 4) for variance in (x, y, yaw))
    return [x, y, NOT_MEASURED, NOT_MEASURED, NOT_MEASURED, yaw]
