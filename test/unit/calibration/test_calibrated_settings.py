"""AMCL's alphas and the covariance of the controller spread as slip does."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.calibration.calibrated_settings import ODOMETRY_HZ, amcl_alphas, controller_params
from diff_encoder_sim.calibration.umbmark import WheelGeometry
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.particles import Move, move_noise

Q, T, B, COUNT_M = 3e-6, 2e-6, 0.4, 2e-3  # slip of a wheel and of turns, separation, travel of a count


@pytest.mark.parametrize('model', ['diff', 'diff-corrected'])
def test_a_line_and_a_turn_of_amcls_updates_are_as_noisy_as_the_wheels(model):
    amcl = AmclParams(odom_model_type=model, update_min_d=0.2, update_min_a=0.5)
    amcl = amcl.model_copy(update=amcl_alphas(Q, T, COUNT_M, B, amcl))
    line, turn = move_noise(Move(0.0, 0.2, 0.0), amcl), move_noise(Move(0.0, 0.0, 0.5), amcl)
    wheels_m2 = 0.2 * Q + COUNT_M**2 / 6.0, 0.5 * B / 2.0 * Q + COUNT_M**2 / 6.0  # of each wheel's travel
    assert math.hypot(line.rotation1_rad, line.rotation2_rad) == pytest.approx(
        math.sqrt(2.0 * wheels_m2[0]) / B, rel=1e-3
    )
    assert line.translation_m == pytest.approx(math.sqrt(2.0 * wheels_m2[0]) / 2.0, rel=1e-3)
    heading_rad = math.sqrt(2.0 * wheels_m2[1] / B**2 + 0.5 * T)
    assert (turn.rotation1_rad, turn.rotation2_rad) == pytest.approx((0.0, heading_rad), rel=1e-3)
    assert turn.translation_m == pytest.approx(math.sqrt(2.0 * wheels_m2[1]) / 2.0, rel=1e-3)


def test_the_noise_of_the_twist_adds_up_to_the_slip_of_the_drive():
    values = {'left_wheel_diameter_m': 0.2, 'right_wheel_diameter_m': 0.2, 'wheel_separation_m': B}
    values.update(slip_m2_per_m=Q, slip_rad2_per_rad=T)
    angles_rad = np.column_stack([np.linspace(0.0, -10.0, 2001), np.linspace(0.0, 30.0, 2001)])  # ways of 1 m and 3 m
    drive = Drive(np.arange(2001) * 10_000_000, angles_rad)  # 20 s
    params = controller_params(values, WheelGeometry(0.25, 0.25, 0.5), [drive])
    steps, (linear, *_, angular) = 20.0 * ODOMETRY_HZ, params['twist_covariance_diagonal']
    assert steps * linear / ODOMETRY_HZ**2 == pytest.approx(Q * 4.0 / 4.0)
    assert steps * angular / ODOMETRY_HZ**2 == pytest.approx(Q * 4.0 / B**2 + T * 4.0 / B)
    assert [params[key] for key in params if 'multiplier' in key] == pytest.approx([0.8, 0.8, 0.8])
    assert (params['wheel_radius'], params['wheel_separation']) == (0.125, 0.5)
