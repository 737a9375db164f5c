"""Whose diameter and separation count, and who is told to disagree."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from urdf_texts import ball, base, box, described, found, joint, link, pair, plugin, robot, usual, wheel


def drive(**sizes):
    return plugin('libdiff_drive.so', leftJoint='left_wheel_joint', rightJoint='right_wheel_joint', **sizes)


def test_the_shapes_tell_the_sizes_where_nobody_else_does():
    description = described(usual())
    assert found(description, 'wheel diameter [m]') == ('0.1', 'collision cylinder')
    assert found(description, 'wheel separation [m]') == ('0.3', 'middles of the wheels')
    assert (description.axle_x_m, description.floor_z_m) == pytest.approx((0.0, 0.0))
    assert description.warnings[:-1] == ()


def test_a_plugin_that_agrees_is_named_as_the_source_without_a_warning():
    description = described(usual(drive(wheelDiameter=0.1, wheelSeparation=0.3)))
    assert found(description, 'wheel diameter [m]') == ('0.1', 'libdiff_drive.so')
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


def test_an_axle_off_the_origin_has_a_place():
    description = described(robot(base(), pair(x_m=-0.12, z_m=-0.05), ball('caster', 0.1, clearance_m=-0.1)))
    assert (description.axle_x_m, description.floor_z_m) == pytest.approx((-0.12, -0.1))


def test_wheels_as_large_as_a_house_are_suspected_to_be_in_millimetres():
    warnings = described(robot(base(body=box(300.0, 200.0, 100.0)), pair(radius_m=50.0, separation_m=300.0))).warnings
    assert any('wheels of 100 m: a URDF is in metres; are its lengths in mm?' in warning for warning in warnings)
