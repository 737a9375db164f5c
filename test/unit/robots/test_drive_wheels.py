"""Which two wheels drive, told by the user, plugins, transmissions, or geometry."""

import pytest

from diff_encoder_sim.base.errors import ConfigError
from urdf_texts import (
    RADIUS_M,
    ball,
    base,
    described,
    found,
    joint,
    link,
    pair,
    plugin,
    robot,
    sphere,
    transmission,
    usual,
    wheel,
)

DRIVE = plugin('libgazebo_ros_diff_drive.so', leftJoint='left_wheel_joint', rightJoint='right_wheel_joint')


def joints_of(text, **choices):
    description = described(text, **choices)
    return description.left.joint, description.right.joint


def test_two_coaxial_wheels_drive_without_any_hint():
    description = described(robot(base(), pair(names=('a', 'b')), ball('front', 0.1)))
    assert (description.left.joint, description.right.joint) == ('a_joint', 'b_joint')
    assert found(description, 'left wheel joint') == ('a_joint', 'geometry')


def test_the_user_goes_before_the_plugin_and_may_name_one_wheel_only():
    other = pair(x_m=0.2, names=('a', 'b'))
    text = usual(other, DRIVE)
    assert joints_of(text) == ('left_wheel_joint', 'right_wheel_joint')
    assert joints_of(text, left_joint='a_joint', right_joint='b_joint') == ('a_joint', 'b_joint')
    assert joints_of(text, right_joint='b_joint') == ('a_joint', 'b_joint')


@pytest.mark.parametrize(
    ('choices', 'complaint'),
    [
        (
            {'left_joint': 'lft_wheel_joint'},
            "given 'lft_wheel_joint' as left wheel joint, which is missing; .*did you mean",
        ),
        (
            {'left_joint': 'ball_caster_joint', 'right_joint': 'right_wheel_joint'},
            'which is fixed; allowed: continuous',
        ),
        (
            {'left_joint': 'right_wheel_joint', 'right_joint': 'left_wheel_joint'},
            'the left wheel left of the right one',
        ),
    ],
)
def test_a_choice_that_is_no_pair_is_refused(choices, complaint):
    with pytest.raises(ConfigError, match=complaint) as caught:
        described(usual(), **choices)
    assert str(caught.value).startswith('made.urdf: ') and '\n' not in str(caught.value)


def test_a_plugin_tells_the_driven_pair_of_four_like_wheels():
    text = robot(base(), pair(x_m=0.2, names=('a', 'b')), pair(), DRIVE)
    assert joints_of(text) == ('left_wheel_joint', 'right_wheel_joint')
    assert [contact.name for contact in described(text).contacts] == ['a', 'b']


def test_transmissions_tell_the_driven_pair():
    driven = transmission('left_wheel_joint') + transmission('right_wheel_joint')
    description = described(robot(base(), pair(x_m=0.2, names=('a', 'b')), pair(), driven))
    assert found(description, 'left wheel joint') == ('left_wheel_joint', 'transmissions')


def test_casters_by_name_or_on_swivels_do_not_drive():
    swivel = link('fork') + joint('swivel', 'fork', '0.2 0 0.1', 'continuous', axis='0 0 1')
    rolling = wheel('roll', radius_m=RADIUS_M, parent='fork', z_m=RADIUS_M - 0.1)
    assert joints_of(robot(base(), pair(), swivel, rolling)) == ('left_wheel_joint', 'right_wheel_joint')
    casters = pair(x_m=0.2, names=('caster_a', 'caster_b'))
    assert joints_of(robot(base(), pair(), casters)) == ('left_wheel_joint', 'right_wheel_joint')


def test_of_two_axles_the_larger_wheels_drive_with_a_warning():
    description = described(robot(base(), pair(), pair(0.02, x_m=0.2, names=('a', 'b'))))
    assert description.left.joint == 'left_wheel_joint'
    assert "and 'a_joint', 'b_joint' to be casters" in ' '.join(description.warnings)


def test_an_axis_to_the_right_drives_backwards():
    left = wheel('left_wheel', y_m=0.15)
    right = wheel('right_wheel', y_m=-0.15, axis='0 -1 0')
    description = described(robot(base(), left, right, ball('caster', 0.1)))
    assert (description.left.is_forward_positive, description.right.is_forward_positive) == (True, False)


def test_wheels_may_hang_on_turned_frames_with_any_axis():
    turned = {'axis': '0 0 1', 'rpy': '-1.5707963267948966 0 0'}
    text = robot(
        base(),
        *(
            link(name, '<cylinder radius="0.05" length="0.02"/>')
            + joint(f'{name}_joint', name, f'0 {y_m} 0.05', 'continuous', **turned)
            for name, y_m in (('left', 0.1), ('right', -0.1))
        ),
        ball('caster', 0.1),
    )
    description = described(text)
    assert description.left.is_forward_positive and description.right.is_forward_positive
    assert description.left.centre_m == pytest.approx((0.0, 0.1, 0.05))
    assert description.wheel_separation_m == pytest.approx(0.2)


def test_wheels_on_the_wrong_side_are_swapped_and_said():
    names = {'leftJoint': 'right_wheel_joint', 'rightJoint': 'left_wheel_joint'}
    description = described(usual(plugin('libgazebo_ros_diff_drive.so', **names)))
    assert (description.left.joint, description.right.joint) == ('left_wheel_joint', 'right_wheel_joint')
    assert "names 'right_wheel_joint' as left joint, which is on the right" in description.warnings[0]
    description = described(robot(base(), pair(names=('right_wheel', 'left_wheel')), ball('caster', 0.1)))
    assert 'is x forward' in description.warnings[0]


def test_a_robot_that_drives_along_y_is_refused():
    along_x = {'axis': '1 0 0', 'origin': 'rpy="0 1.5707963267948966 0"'}
    sideways = wheel('a', x_m=0.15, **along_x) + wheel('b', x_m=-0.15, **along_x)
    with pytest.raises(ConfigError, match='so it drives along y; allowed: wheels apart along y, x forward'):
        described(robot(base(), sideways))


def test_a_plugin_that_names_a_joint_of_another_robot_is_named_and_passed_over():
    description = described(usual(plugin('libgazebo_ros_diff_drive.so', leftJoint='wheel_l', rightJoint='wheel_r')))
    assert description.left.joint == 'left_wheel_joint'
    assert "names joint 'wheel_l', which the robot does not have" in description.warnings[0]


def test_a_revolute_joint_without_an_end_turns_a_wheel():
    endless = {'kind': 'revolute', 'inside': '<limit lower="-1e9" upper="1e9" effort="1" velocity="1"/>'}
    assert joints_of(robot(base(), pair(**endless), ball('ball', 0.1))) == ('left_wheel_joint', 'right_wheel_joint')
    with pytest.raises(ConfigError, match='none of its 3 joints is continuous'):
        described(
            robot(base(), pair(**{**endless, 'inside': endless['inside'].replace('1e9', '1')}), ball('ball', 0.1))
        )


@pytest.mark.parametrize('name', ["j'l", 'j&quot;l', 'j]l', "j'l&quot;"])
def test_a_joint_may_have_any_name(name):
    endless = {'kind': 'revolute', 'inside': '<limit lower="-9" upper="9" effort="1" velocity="1"/>'}
    text = robot(base(), pair(**endless), ball('ball', 0.1)).replace('left_wheel_joint', name)
    assert joints_of(text) == (name.replace('&quot;', '"'), 'right_wheel_joint')


def test_an_arm_and_a_spinning_scanner_are_no_wheels():
    arm = link('hand', sphere(0.05)) + joint('elbow', 'hand', '0 0 0.5', 'continuous')
    scanner = link('rotor', sphere(0.05)) + joint('spin', 'rotor', '0 0 0.06', 'continuous', axis='0 0 1')
    description = described(usual(arm, scanner))
    assert description.left.joint == 'left_wheel_joint'
    assert 'joints held still at zero: elbow, spin (continuous)' in description.notes
