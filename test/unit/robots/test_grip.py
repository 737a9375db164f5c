"""What the driven wheels pass on, in closed form."""

import numpy as np
import pytest

from diff_encoder_sim.robots.contacts import WheelBase
from diff_encoder_sim.robots.description import GroundContact, MassProperties
from diff_encoder_sim.robots.drive_train import (
    G_MPS2,
    MARGIN,
    sensible_acceleration_mps2,
    sensible_turn_acceleration_radps2,
    torque_accelerations,
)
from urdf_texts import ball, base, described, pair, plugin, robot, usual

WHEELS = WheelBase(0.1, -0.05, 0.05, ())


def acceleration_mps2(com_x_m, com_z_m, *contacts_x_m):
    mass = MassProperties(2.0, np.array([com_x_m, 0.0, com_z_m]), np.eye(3))
    contacts = [GroundContact('any', (x_m, 0.0, -0.05)) for x_m in contacts_x_m]
    return sensible_acceleration_mps2(mass, contacts, WHEELS)


def test_wheels_below_the_centre_of_mass_on_the_floor_have_all_the_weight():
    assert acceleration_mps2(0.1, -0.05, 0.3, -0.1) == pytest.approx(MARGIN * G_MPS2)
    assert acceleration_mps2(0.2, 0.1) == pytest.approx(MARGIN * G_MPS2)


@pytest.mark.parametrize('side', [1, -1])
def test_a_caster_takes_weight_and_takes_more_the_higher_the_centre_of_mass(side):
    """At the limit, the wheels' load m (g (1 - d/c) - a h/c) is the force m a that they pass on."""
    d_m, c_m, h_m = 0.05, 0.2, 0.1
    found = acceleration_mps2(0.1 + side * d_m, h_m - 0.05, 0.1 + side * c_m, 0.1 - side * 0.01)
    a_mps2 = found / MARGIN
    assert G_MPS2 * (1 - d_m / c_m) - a_mps2 * h_m / c_m == pytest.approx(a_mps2)


@pytest.mark.parametrize('com_y_m', [0.0, 0.1])
def test_turning_in_place_takes_half_of_the_grip_at_both_wheels(com_y_m):
    """At the limit, two forces m g (1 - d/c) / 2 at L/2 from the axle's middle turn I + m d^2."""
    mass = MassProperties(2.0, np.array([0.15, com_y_m, 0.05]), 0.4 * np.eye(3))
    contacts = [GroundContact('any', (0.3, 0.0, -0.05))]
    found = sensible_turn_acceleration_radps2(mass, contacts, WHEELS, 0.5)
    inertia_kgm2 = 0.4 + 2.0 * (0.05**2 + com_y_m**2)
    assert found / MARGIN * inertia_kgm2 == pytest.approx(2.0 * G_MPS2 * (1 - 0.05 / 0.2) * 0.25)


def test_torque_moves_the_body_by_two_forces_at_the_rims():
    mass = MassProperties(2.0, np.array([0.1, 0.0, 0.05]), 0.4 * np.eye(3))
    linear_mps2, angular_radps2 = torque_accelerations(0.3, mass, WHEELS, 0.5)
    assert linear_mps2 / MARGIN == pytest.approx(2 * (0.3 / 0.05) / 2.0)
    assert angular_radps2 / MARGIN == pytest.approx(2 * (0.3 / 0.05) * 0.25 / 0.4)


def test_the_usual_acceleration_is_cut_where_a_caster_carries_most():
    heavy_front = described(robot(base(com_x_m=0.08), pair(), ball('ball', 0.1))).drive_limits
    assert heavy_front['max_linear_acceleration'] < 1.5
    assert 'max_linear_acceleration' not in described(usual()).drive_limits


def test_a_plugins_acceleration_beyond_the_grip_is_cut_and_a_smaller_one_is_not():
    joints = {'leftJoint': 'left_wheel_joint', 'rightJoint': 'right_wheel_joint'}
    slow = described(usual(plugin('libdiff_drive.so', **joints, wheelAcceleration=0.5))).drive_limits
    fast = described(usual(plugin('libdiff_drive.so', **joints, wheelAcceleration=60))).drive_limits
    assert slow['max_linear_acceleration'] == 0.5
    assert 0.5 < fast['max_linear_acceleration'] < MARGIN * G_MPS2
    assert fast['max_angular_acceleration'] == pytest.approx(2 * fast['max_linear_acceleration'] / 0.3)
