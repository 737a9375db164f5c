"""Diameter, separation and limits of a drive, and the force that the driven wheels pass on in closed form."""

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.describing import G_MPS2, MARGIN, grip_accelerations, torque_accelerations
from diff_encoder_sim.robots.description import DrivenWheel, DriveTrain, GroundContact
from diff_encoder_sim.robots.solids import MassProperties
from urdf_texts import ball, base, box, described, found, joint, link, pair, plugin, robot, usual, wheel

CHOSEN = {'left_joint': 'left_wheel_joint', 'right_joint': 'right_wheel_joint'}


def drive(**sizes):
    return plugin('libdiff_drive.so', leftJoint='left_wheel_joint', rightJoint='right_wheel_joint', **sizes)


OTHER_WHEELS = plugin('libdiff.so', leftJoint='a_joint', rightJoint='b_joint', wheelDiameter=0.11)
GIVEN = {'wheel_diameter': 0.11, 'wheel_separation': 0.31}
SHAPE, MIDDLES = ('0.1', 'collision cylinder'), ('0.3', 'middles of the wheels')


@pytest.mark.parametrize(
    ('parts', 'choices', 'diameter', 'separation', 'warning'),
    [
        ((), {}, SHAPE, MIDDLES, ''),
        ((drive(wheelDiameter=0.098),), {}, ('0.098', 'libdiff_drive.so'), MIDDLES, '0.098 m is used'),
        ((drive(wheelDiameter=0.05),), {}, SHAPE, MIDDLES, '0.1 m is used'),  # a radius
        ((drive(wheelSeparation=0.33),), {}, SHAPE, MIDDLES, 'which is used'),
        ((drive(wheelDiameter=0.1),), GIVEN, ('0.11', 'given'), ('0.31', 'given'), 'would tip'),
        ((pair(x_m=-0.2, names=('a', 'b')), OTHER_WHEELS), CHOSEN, SHAPE, MIDDLES, 'slide without friction'),
    ],
)
def test_sizes_their_sources_and_disagreements(parts, choices, diameter, separation, warning):
    description = described(usual(*parts), **choices)
    assert diameter == found(description, 'wheel diameter [m]')
    assert separation == found(description, 'wheel separation [m]')
    apart_m = description.left.centre_m[1] - description.right.centre_m[1]
    assert description.wheel_separation_m == pytest.approx(apart_m)
    assert warning in ' '.join(description.warnings[:-1]) and bool(description.warnings[:-1]) == bool(warning)


TWO_SIZES = wheel('left', y_m=0.15, radius_m=0.0352, z_m=0.0352) + wheel('right', y_m=-0.15, radius_m=0.035, z_m=0.0352)
ASIDE = wheel('left_wheel', y_m=0.16) + wheel('right_wheel', y_m=-0.14)


@pytest.mark.parametrize(
    ('text', 'diameter_m', 'expected'),
    [
        (robot(base(), TWO_SIZES, ball('ball', 0.1)), 0.0702, 'diameters 0.0704 m (left) and 0.07 m (right)'),
        (robot(base(body=box(300, 200, 100)), pair(50.0, 300.0)), 100.0, 'wheels of 100 m: a URDF is'),
        (robot(base(), ASIDE, ball('ball', 0.1)), 0.1, "the wheels' middle is 10.0 mm to the left of the base frame's"),
    ],
)
def test_wheels_of_two_sizes_in_millimetres_or_aside_are_warnings(text, diameter_m, expected):
    description = described(text)
    assert description.wheel_diameter_m == pytest.approx(diameter_m)
    assert any(expected in warning for warning in description.warnings)


def test_the_separation_is_that_of_the_tyres_and_not_of_the_joints():
    origin = 'xyz="0 {} 0" rpy="1.5707963267948966 0 0"'
    wheels = wheel('left', y_m=0.1, origin=origin.format(0.02)) + wheel('right', y_m=-0.1, origin=origin.format(-0.02))
    assert described(robot(base(), wheels, ball('caster', 0.1))).wheel_separation_m == pytest.approx(0.24)


def test_a_tyre_may_be_a_separate_link_with_a_visual_shape():
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
    parts = base(), wheels, ball('caster', 0.1)
    assert described(robot(*parts, drive(wheelDiameter=0.1))).wheel_diameter_m == 0.1
    assert described(robot(*parts), wheel_diameter=0.1, **CHOSEN).wheel_diameter_m == 0.1
    with pytest.raises(ConfigError, match="wheels 'left_wheel' and 'right_wheel' without a round shape; allowed: "):
        described(robot(*parts), **CHOSEN)


WEIGHT_N = (2.0 + 0.2) * 9.81


def limits_of(*parts, effort=None, velocity=0, **given):
    limits = '' if effort is None else f'<limit effort="{effort}" velocity="{velocity}"/>'
    return described(robot(base(**given), pair(inside=limits), ball('ball', 0.1), *parts)).drive_limits


def test_limits_are_those_of_plugin_and_joints_and_no_more_than_the_floor_takes():
    most_nm = pytest.approx(WEIGHT_N * 0.05)
    assert limits_of() == {'wheel_torque': most_nm}
    assert limits_of(drive(wheelTorque=0.4))['wheel_torque'] == 0.4
    assert limits_of(drive(wheelTorque=20))['wheel_torque'] == most_nm
    assert limits_of(drive(wheelTorque=0.3), effort=0.5, velocity=10)['wheel_torque'] == 0.3
    rim = limits_of(drive(wheelAcceleration=1.8))
    assert rim['max_linear_acceleration'] == 1.8
    assert rim['max_angular_acceleration'] == pytest.approx(1.8 / 0.15)
    motors = limits_of(effort=0.5, velocity=10.0)
    assert (motors['wheel_torque'], motors['max_linear_speed']) == (0.5, pytest.approx(0.5))
    assert motors['max_angular_speed'] == pytest.approx(0.5 / 0.15)


@pytest.mark.parametrize(('velocity', 'warned'), [(0, False), (1000, False), (0.1, True)])
def test_placeholders_are_no_limits(velocity, warned):
    text = robot(base(), pair(inside=f'<limit effort="0" velocity="{velocity}"/>'), ball('ball', 0.1))
    assert list(described(text).drive_limits) == ['wheel_torque']
    assert any('too slow to drive' in warning for warning in described(text).warnings) == warned


def test_accelerations_give_way_to_low_torque_a_large_inertia_and_little_grip():
    weak = limits_of(effort=0.02, velocity=10.0)
    assert weak['max_linear_acceleration'] == pytest.approx(0.5 * 2 * 0.02 / 0.05 / 2.2)
    given = limits_of(drive(wheelAcceleration=1.0), effort=0.02, velocity=10.0)
    assert given['max_linear_acceleration'] == 1.0  # not lowered to the torque
    assert limits_of(com_x_m=0.08)['max_linear_acceleration'] < 1.5
    long = base(body=box(1.2, 0.2, 0.1)).replace('iyy="0.01" izz="0.01"', 'iyy="0.3" izz="0.3"')
    limits = described(robot(long, pair(), ball('ball', 0.1))).drive_limits
    force_n = 0.5 * WEIGHT_N * (1 - 0.02 * 2.0 / 2.2 / 0.1)
    assert limits['max_angular_acceleration'] == pytest.approx(force_n * 0.15 / 0.305, rel=0.02)
    assert 'max_linear_acceleration' not in limits
    fast = limits_of(drive(wheelAcceleration=60))
    assert 0.5 < fast['max_linear_acceleration'] < MARGIN * G_MPS2
    assert fast['max_angular_acceleration'] == pytest.approx(2 * fast['max_linear_acceleration'] / 0.3)


LEFT, RIGHT = (DrivenWheel('', '', (0.1, y_m, 0.0), (0.0, 1.0, 0.0), 0.05, '', None) for y_m in (0.25, -0.25))
TRAIN = DriveTrain(LEFT, RIGHT, 0.1, 0.5)  # axle at x = 0.1, floor at z = -0.05


def grip(com_m, *contacts_x_m, inertia_kgm2=1.0):
    mass = MassProperties(2.0, np.array(com_m), inertia_kgm2 * np.eye(3))
    return grip_accelerations(mass, [GroundContact('any', (x_m, 0.0, -0.05)) for x_m in contacts_x_m], TRAIN)


def test_wheels_below_the_centre_of_mass_on_the_floor_have_all_the_weight():
    assert grip((0.1, 0.0, -0.05), 0.3, -0.1)[0] == pytest.approx(MARGIN * G_MPS2)
    assert grip((0.2, 0.0, 0.1))[0] == pytest.approx(MARGIN * G_MPS2)


@pytest.mark.parametrize('side', [1, -1])
def test_a_caster_takes_weight_and_takes_more_the_higher_the_centre_of_mass(side):
    """At the limit, the wheels' load m (g (1 - d/c) - a h/c) is the force m a that they pass on."""
    d_m, c_m, h_m = 0.05, 0.2, 0.1
    a_mps2 = grip((0.1 + side * d_m, 0.0, h_m - 0.05), 0.1 + side * c_m, 0.1 - side * 0.01)[0] / MARGIN
    assert G_MPS2 * (1 - d_m / c_m) - a_mps2 * h_m / c_m == pytest.approx(a_mps2)


@pytest.mark.parametrize('com_y_m', [0.0, 0.1])
def test_turning_in_place_takes_half_of_the_grip_at_both_wheels(com_y_m):
    """At the limit, two forces m g (1 - d/c) / 2 at L/2 from the axle's middle turn I + m d^2."""
    turn_radps2 = grip((0.15, com_y_m, 0.05), 0.3, inertia_kgm2=0.4)[1]
    inertia_kgm2 = 0.4 + 2.0 * (0.05**2 + com_y_m**2)
    assert turn_radps2 / MARGIN * inertia_kgm2 == pytest.approx(2.0 * G_MPS2 * (1 - 0.05 / 0.2) * 0.25)


def test_torque_moves_the_body_by_two_forces_at_the_rims():
    mass = MassProperties(2.0, np.array([0.1, 0.0, 0.05]), 0.4 * np.eye(3))
    linear_mps2, angular_radps2 = torque_accelerations(0.3, mass, TRAIN)
    assert linear_mps2 / MARGIN == pytest.approx(2 * (0.3 / 0.05) / 2.0)
    assert angular_radps2 / MARGIN == pytest.approx(2 * (0.3 / 0.05) * 0.25 / 0.4)
