"""YAML for other packages: their documented names, and values with which they spread as the odometry does."""

import math
from pathlib import Path

import numpy as np
import pytest
import yaml

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.particles import Move, move_noise
from diff_encoder_sim.wheels.chain import Chain
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.ros_parameters import (
    DISTANCE_M,
    RATE_HZ,
    ROTATION_RAD,
    SPEED_MPS,
    TURN_RADPS,
    WINDOW,
    RosWheels,
    amcl_alphas,
    pose_variances,
    ros_parameters,
    twist_variances,
)
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams

DOCUMENTED = yaml.safe_load(Path(__file__).with_name('documented_parameters.yaml').read_text())
Q, T, B, D = 3e-6, 2e-6, 0.4, 0.2  # slip of a wheel and of turns, separation, diameter
FINE = 1e9  # pulses per revolution


def wheels_of(turn_noise=0.0, **params):
    odometry = {'wheel_diameter': D, 'wheel_separation': B, 'ppr': FINE, 'motion_noise': Q}
    return RosWheels(OdometryParams.from_mapping({**odometry, **params}, ''), 'a robot', turn_noise=turn_noise)


@pytest.mark.parametrize(('version', 'nodes'), DOCUMENTED.items())
def test_all_names_are_documented_and_all_numbers_have_the_type_that_the_packages_require(version, nodes):
    text = getattr(ros_parameters(wheels_of(ppr=4096)), version)
    found = yaml.safe_load(text)
    assert found.keys() == nodes.keys()
    for node, of_node in found.items():
        values = of_node['ros__parameters'] if version == 'ros2' else of_node
        assert {*values} <= {*nodes[node]['names']}
        for key, value in values.items():
            if key.endswith('_covariance_diagonal'):  # diff_drive_controller of ROS 1 asserts doubles
                assert [type(each) for each in value] == [float] * 6 and min(value) > 0.0
            elif key == 'odom0_config':
                assert len(value) == 15 and [index for index, is_fused in enumerate(value) if is_fused] == [6, 7, 11]
            else:
                assert type(value) in (float, str, bool) or key == 'velocity_rolling_window_size', key
    lines = text.splitlines()
    uncommented = [line for above, line in zip(lines, lines[1:]) if ': ' in line and '# ' not in above + line]
    assert uncommented == [] and max(map(len, lines)) <= 110


def test_a_nominal_geometry_is_kept_and_corrected_by_multipliers():
    unequal = wheels_of(wheel_diameter={'left': 0.2, 'right': 0.202}, wheel_separation=0.41)
    values = ros_parameters(unequal._replace(nominal_m=(0.25, 0.25, 0.5))).diff_drive_controller
    names = [f'{key}_multiplier' for key in ('wheel_separation', 'left_wheel_radius', 'right_wheel_radius')]
    assert (values['wheel_separation'], values['wheel_radius']) == (0.5, 0.125)
    assert [values[name] for name in names] == pytest.approx([0.82, 0.8, 0.808])
    values = ros_parameters(unequal).diff_drive_controller
    assert [values[name] for name in names] == pytest.approx([1.0, 0.2 / 0.201, 0.202 / 0.201], rel=1e-6)
    measured = ros_parameters(unequal._replace(measured=([0.0, 2.0, 3.0], 'SL'))).diff_drive_controller
    assert measured['pose_covariance_diagonal'] == [1e-9, 2.0, 1e6, 1e6, 1e6, 3.0]


@pytest.mark.parametrize('encoder', [{}, {'edge_error': 0.3}])
def test_the_twist_varies_as_that_of_encoders_at_many_phases(encoder):
    counting, draws, window_s = {'ppr': 360, 'encoder': encoder}, 300, WINDOW / RATE_HZ
    wheels = wheels_of(motion_noise=1e-12, **counting)
    stamps_ns = (1e9 * window_s * np.arange(61)).astype(np.int64)
    ways_m = window_s * np.outer(np.arange(61), [SPEED_MPS - 0.5 * B * TURN_RADPS, SPEED_MPS + 0.5 * B * TURN_RADPS])
    phases_rad = np.random.default_rng(3).uniform(0.0, 2.0 * np.pi, (draws, 2))
    drive = Drive(stamps_ns, np.cumsum(ways_m, axis=0) / 10.0 / (0.5 * D))  # at all fractions of a count
    chain = Chain(EncoderParams.from_mapping({**counting, 'rate': 1.0 / window_s}, ''), wheels.odometry, draws)
    counted_m = np.diff(chain.run(drive, phases_rad, rows=np.arange(61)).counts, axis=1) * math.pi * D / 360
    errors = (counted_m - np.diff(drive.wheel_angles_rad, axis=0) * 0.5 * D) / window_s
    found = np.mean(errors.mean(axis=2) ** 2), np.mean((np.diff(errors, axis=2) / B) ** 2)
    assert twist_variances(wheels) == pytest.approx(found, rel=0.04)


def test_the_noise_of_all_twists_of_a_drive_adds_up_to_its_slip():
    seconds, way_m = 20.0, 2.0 * SPEED_MPS * 20.0  # of both wheels
    linear, angular = twist_variances(wheels_of(turn_noise=T))
    assert seconds * linear / RATE_HZ == pytest.approx(Q * way_m / 4.0, rel=1e-4)
    assert seconds * angular / RATE_HZ == pytest.approx(Q * way_m / B**2 + T * TURN_RADPS * seconds, rel=1e-4)


def test_errors_of_the_geometry_are_in_twist_and_pose():
    wheels = wheels_of(distance_std=0.01, turn_std=0.02, diameter_difference_std=0.03)
    twist, exact = np.array(twist_variances(wheels)), np.array(twist_variances(wheels_of()))
    of_turn = (0.02 * TURN_RADPS) ** 2 + (0.03 * SPEED_MPS / B) ** 2
    assert twist - exact == pytest.approx([(0.01 * SPEED_MPS) ** 2, of_turn], rel=1e-6)
    heading = 0.03 / B
    expected = [(0.01 * DISTANCE_M) ** 2, (heading * DISTANCE_M**2 / 2.0) ** 2, (heading * DISTANCE_M) ** 2]
    assert np.subtract(pose_variances(wheels), pose_variances(wheels_of())) == pytest.approx(expected, rel=1e-6)


def test_the_pose_spreads_as_the_closed_forms():
    x, y, yaw = pose_variances(wheels_of(ppr=360))
    pulse_m, heading = math.pi * D / 360, 2.0 * Q * DISTANCE_M / B**2
    assert x == pytest.approx(Q * DISTANCE_M / 2.0 + pulse_m**2 / 12.0, rel=0.01)
    assert y == pytest.approx((DISTANCE_M * pulse_m / B) ** 2 / 6.0 + heading * DISTANCE_M**2 / 3.0, rel=0.01)
    assert yaw == pytest.approx((pulse_m / B) ** 2 / 3.0 + heading, rel=1e-6)


@pytest.mark.parametrize('model', ['diff', 'diff-corrected'])
def test_a_line_and_a_turn_of_amcls_updates_are_as_noisy_as_the_wheels(model):
    wheels = wheels_of(turn_noise=T, ppr=math.pi * D / 2e-3)  # 2 mm per count
    alphas = amcl_alphas(wheels, 0.2, 0.5, model == 'diff-corrected')
    amcl = AmclParams(odom_model_type=model, **{f'odom_{name}': alpha for name, alpha in alphas.items()})
    line, turn = move_noise(Move(0.0, 0.2, 0.0), amcl), move_noise(Move(0.0, 0.0, 0.5), amcl)
    wheels_m2 = 0.2 * Q + 2e-3**2 / 6.0, 0.5 * B / 2.0 * Q + 2e-3**2 / 6.0  # of each wheel's travel
    assert math.hypot(line.rotation1_rad, line.rotation2_rad) == pytest.approx(
        math.sqrt(2.0 * wheels_m2[0]) / B, rel=1e-3
    )
    assert line.translation_m == pytest.approx(math.sqrt(2.0 * wheels_m2[0]) / 2.0, rel=1e-3)
    heading_rad = math.sqrt(2.0 * wheels_m2[1] / B**2 + 0.5 * T)
    assert (turn.rotation1_rad, turn.rotation2_rad) == pytest.approx((0.0, heading_rad), rel=1e-3)
    assert turn.translation_m == pytest.approx(math.sqrt(2.0 * wheels_m2[1]) / 2.0, rel=1e-3)


def test_errors_of_the_geometry_add_up_over_the_updates_of_ten_metres_and_of_a_turn():
    stds = {'distance_std': 0.01, 'turn_std': 0.02, 'diameter_difference_std': 0.03}
    alphas = [amcl_alphas(wheels_of(motion_noise=1e-12, **each), 0.2, 0.5) for each in (stds, {})]
    alpha1, alpha2, alpha3, _ = (of_errors - exact for of_errors, exact in zip(*(each.values() for each in alphas)))
    assert alpha1 * 0.5**2 * ROTATION_RAD / 0.5 == pytest.approx((0.02 * ROTATION_RAD) ** 2, rel=1e-3)
    assert 2.0 * alpha2 * 0.2**2 * DISTANCE_M / 0.2 == pytest.approx((0.03 * DISTANCE_M / B) ** 2, rel=1e-3)
    assert alpha3 * 0.2**2 * DISTANCE_M / 0.2 == pytest.approx((0.01 * DISTANCE_M) ** 2, rel=1e-3)
