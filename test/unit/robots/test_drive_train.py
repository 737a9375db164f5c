"""Diameter, separation and limits of a drive, and what the driven wheels pass on in closed form."""

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.contacts import WheelBase
from diff_encoder_sim.robots.description import GroundContact, MassProperties
from diff_encoder_sim.robots.drive_train import (
    G_MPS2,
    MARGIN,
    sensible_acceleration_mps2,
    sensible_turn_acceleration_radps2,
    torque_accelerations,
)
from urdf_texts import ball, base, box, described, found, joint, link, pair, plugin, robot, usual, wheel


def drive(**sizes):
    return plugin('libdiff_drive.so', leftJoint='left_wheel_joint', rightJoint='right_wheel_joint', **sizes)


def test_the_shapes_tell_the_sizes_where_nobody_else_does():
    description = described(usual())
    assert found(description, 'wheel diameter [m]') == ('0.1', 'collision cylinder')
    assert found(description, 'wheel separation [m]') == ('0.3', 'middles of the wheels')
    assert (description.axle_x_m, description.floor_z_m) == pytest.approx((0.0, 0.0))
    assert description.warnings[:-1] == ()


def test_a_diameter_that_is_measured_goes_before_the_shapes_with_a_warning():
    description = described(usual(drive(wheelDiameter=0.098)))
    assert description.wheel_diameter_m == 0.098
    assert description.warnings[0] == (
        'wheel diameter: 0.098 m by libdiff_drive.so, 0.1 m by the collision cylinder: 0.098 m is used'
    )


def test_a_radius_in_place_of_a_diameter_is_not_believed():
    description = described(usual(drive(wheelDiameter=0.05)))
    assert description.wheel_diameter_m == pytest.approx(0.1)
    assert description.warnings[0].endswith('0.1 m is used')


def test_a_separation_that_differs_from_the_wheels_places_is_a_warning():
    description = described(usual(drive(wheelSeparation=0.33)))
    assert description.wheel_separation_m == pytest.approx(0.3)
    assert description.warnings[0] == (
        'wheel separation: 0.33 m by libdiff_drive.so, 0.3 m between the middles of the wheels, which is used'
    )


def test_the_user_goes_before_all():
    description = described(usual(drive(wheelDiameter=0.1)), wheel_diameter=0.11, wheel_separation=0.31)
    assert (description.wheel_diameter_m, description.wheel_separation_m) == (0.11, 0.31)
    assert description.left.centre_m[1] - description.right.centre_m[1] == pytest.approx(0.31)
    assert found(description, 'wheel diameter [m]') == ('0.11', 'given')


def test_wheels_of_two_sizes_get_the_mean_and_a_warning():
    wheels = wheel('left', y_m=0.15, radius_m=0.0352, z_m=0.0352) + wheel(
        'right', y_m=-0.15, radius_m=0.035, z_m=0.0352
    )
    description = described(robot(base(), wheels, ball('caster', 0.1)))
    assert description.wheel_diameter_m == pytest.approx(0.0702)
    assert 'diameters 0.0704 m (left) and 0.07 m (right)' in description.warnings[0]


def test_the_separation_is_that_of_the_tyres_and_not_of_the_joints():
    origin = 'xyz="0 {} 0" rpy="1.5707963267948966 0 0"'
    wheels = wheel('left', y_m=0.1, origin=origin.format(0.02)) + wheel('right', y_m=-0.1, origin=origin.format(-0.02))
    assert described(robot(base(), wheels, ball('caster', 0.1))).wheel_separation_m == pytest.approx(0.24)


def test_a_tyre_may_be_a_link_of_its_own_and_a_visual_shape_may_tell():
    wheels = ''.join(
        link(f'{side}_hub', mass_kg=0.1)
        + joint(f'{side}_hub_joint', f'{side}_hub', f'0 {y_m} 0.05', 'continuous')
        + link(f'{side}_tyre', '<sphere radius="0.05"/>', shape='visual')
        + joint(f'{side}_tyre_joint', f'{side}_tyre', '0 0 0', parent=f'{side}_hub')
        for side, y_m in (('left', 0.1), ('right', -0.1))
    )
    description = described(robot(base(), wheels, ball('caster', 0.1)))
    assert found(description, 'wheel diameter [m]') == ('0.1', 'visual sphere')


def test_wheels_without_a_round_shape_need_a_diameter():
    wheels = ''.join(
        link(f'{side}_wheel', box(0.1, 0.02, 0.1), mass_kg=0.1)
        + joint(f'{side}_wheel_joint', f'{side}_wheel', f'0 {y_m} 0.05', 'continuous')
        for side, y_m in (('left', 0.1), ('right', -0.1))
    )
    text = robot(base(), wheels, ball('caster', 0.1))
    assert described(text.replace('</robot>', drive(wheelDiameter=0.1) + '</robot>')).wheel_diameter_m == 0.1
    given = {'left_joint': 'left_wheel_joint', 'right_joint': 'right_wheel_joint'}
    assert described(text, wheel_diameter=0.1, **given).wheel_diameter_m == 0.1
    with pytest.raises(
        ConfigError, match="wheels 'left_wheel' and 'right_wheel' without a round shape; allowed: a coll"
    ):
        described(text, **given)


def test_wheels_as_large_as_a_house_are_suspected_to_be_in_millimetres():
    warnings = described(robot(base(body=box(300.0, 200.0, 100.0)), pair(radius_m=50.0, separation_m=300.0))).warnings
    assert any('wheels of 100 m: a URDF is in metres; are its lengths in mm?' in warning for warning in warnings)


WEIGHT_N = (2.0 + 0.2) * 9.81


def with_joint_limits(effort, velocity):
    limits = f'<limit effort="{effort}" velocity="{velocity}"/>'
    return robot(base(), pair(inside=limits), ball('ball', 0.1))


def test_without_any_limit_the_torque_is_what_the_floor_takes():
    limits = described(usual()).drive_limits
    assert limits == {'wheel_torque': pytest.approx(WEIGHT_N * 0.05)}


def test_a_plugins_torque_counts_unless_wheels_could_only_slip():
    assert described(usual(drive(wheelTorque=0.4))).drive_limits['wheel_torque'] == 0.4
    description = described(usual(drive(wheelTorque=20)))
    assert description.drive_limits['wheel_torque'] == pytest.approx(WEIGHT_N * 0.05)
    assert found(description, 'wheel torque [N m]')[1] == (
        'mass x g x wheel radius: more only slips (given by libdiff_drive.so: 20)'
    )


def test_a_rims_acceleration_limits_driving_and_turning():
    limits = described(usual(drive(wheelAcceleration=1.8))).drive_limits
    assert limits['max_linear_acceleration'] == 1.8
    assert limits['max_angular_acceleration'] == pytest.approx(1.8 / 0.15)


def test_joint_limits_are_those_of_the_motors():
    limits = described(with_joint_limits(0.5, 10.0)).drive_limits
    assert limits['wheel_torque'] == 0.5
    assert limits['max_linear_speed'] == pytest.approx(0.5)
    assert limits['max_angular_speed'] == pytest.approx(0.5 / 0.15)


@pytest.mark.parametrize(('velocity', 'warned'), [(0, False), (1000, False), (0.1, True)])
def test_placeholders_are_no_limits(velocity, warned):
    description = described(with_joint_limits(0, velocity))
    assert list(description.drive_limits) == ['wheel_torque']
    assert any('too slow to drive' in warning for warning in description.warnings) == warned


def test_the_plugin_goes_before_the_joints():
    text = with_joint_limits(0.5, 10.0).replace('</robot>', drive(wheelTorque=0.3) + '</robot>')
    assert described(text).drive_limits['wheel_torque'] == 0.3


def test_usual_accelerations_give_way_to_a_low_torque_and_a_large_inertia():
    weak = described(with_joint_limits(0.02, 10.0)).drive_limits
    assert weak['max_linear_acceleration'] == pytest.approx(0.5 * 2 * 0.02 / 0.05 / 2.2)
    long = base(body=box(1.2, 0.2, 0.1)).replace('iyy="0.01" izz="0.01"', 'iyy="0.3" izz="0.3"')
    limits = described(robot(long, pair(), ball('ball', 0.1))).drive_limits
    force_n = 0.5 * WEIGHT_N * (1 - 0.02 * 2.0 / 2.2 / 0.1)
    assert limits['max_angular_acceleration'] == pytest.approx(force_n * 0.15 / 0.305, rel=0.02)
    assert 'max_linear_acceleration' not in limits


def test_an_acceleration_in_the_file_is_not_lowered_to_the_torque():
    text = with_joint_limits(0.02, 10.0).replace('</robot>', drive(wheelAcceleration=1.0) + '</robot>')
    assert described(text).drive_limits['max_linear_acceleration'] == 1.0


def test_wheels_beside_the_base_frames_axis_are_a_warning():
    off = wheel('left_wheel', y_m=0.16) + wheel('right_wheel', y_m=-0.14)
    description = described(robot(base(), off, ball('ball', 0.1)))
    assert "the wheels' middle is 10.0 mm to the left of the base frame's x axis" in description.warnings[0]


def test_a_plugin_of_other_wheels_says_nothing_of_these():
    other = plugin('libdiff_drive.so', leftJoint='a_joint', rightJoint='b_joint', wheelDiameter=0.11)
    text = usual(pair(x_m=-0.2, names=('a', 'b')), other)
    chosen = {'left_joint': 'left_wheel_joint', 'right_joint': 'right_wheel_joint'}
    assert described(text, **chosen).wheel_diameter_m == 0.1
    assert described(text).wheel_diameter_m == 0.11


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
