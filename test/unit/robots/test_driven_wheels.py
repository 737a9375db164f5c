"""Which two wheels drive: by the user, plugins, transmissions, or geometry; and robots of other kinds."""

import math

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.describing import describe
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.robot_file import load_robot_file
from diff_encoder_sim.robots.robot_setup import set_up_robot
from urdf_texts import ball, base, described, found, joint, link, pair, plugin, robot, transmission, usual, wheel

USUAL = 'left_wheel_joint', 'right_wheel_joint'
DRIVE = plugin('libgazebo_ros_diff_drive.so', leftJoint=USUAL[0], rightJoint=USUAL[1])
FRONT_DRIVE = DRIVE.replace(USUAL[0], 'a_joint').replace(USUAL[1], 'b_joint')
FRONT_PAIR = pair(x_m=0.2, names=('a', 'b'))
SWIVEL = link('fork') + joint('swivel', 'fork', '0.3 0 0.1', 'continuous', axis='0 0 1')
ROLL = wheel('front', parent='fork', z_m=-0.05)
ENDLESS = '<limit lower="-1e9" upper="1e9" effort="1" velocity="1"/>'
STEERED = SWIVEL.replace('continuous', 'revolute').replace(
    '</joint>', '<limit lower="-0.6" upper="0.6" effort="1" velocity="1"/></joint>'
)


def joints_of(text, **choices):
    description = described(text, **choices)
    return description.left.joint, description.right.joint


def test_the_user_precedes_the_plugin_and_may_name_only_one_wheel():
    text = usual(FRONT_PAIR, DRIVE)
    assert joints_of(text) == USUAL
    assert joints_of(text, left_joint='a_joint', right_joint='b_joint') == ('a_joint', 'b_joint')
    assert joints_of(text, right_joint='b_joint') == ('a_joint', 'b_joint')


@pytest.mark.parametrize(
    ('left', 'right', 'complaint'),
    [
        ('lft_wheel_joint', '', "given 'lft_wheel_joint' as left wheel joint, which is missing"),
        ('ball_caster_joint', USUAL[1], 'which is fixed'),
        (USUAL[1], USUAL[0], 'left wheel left of the right one'),
    ],
)
def test_a_choice_that_is_no_pair_is_refused(left, right, complaint):
    with pytest.raises(ConfigError, match=f'^made.urdf: [^\n]*{complaint}'):
        described(usual(), left_joint=left, right_joint=right)


@pytest.mark.parametrize(
    ('parts', 'source'),
    [
        ((FRONT_PAIR, pair(), DRIVE), 'libgazebo_ros_diff_drive.so'),
        ((FRONT_PAIR, pair(), *map(transmission, USUAL)), 'transmissions'),
        ((pair(), SWIVEL, ROLL), 'geometry'),  # a free swivel is a caster's
        ((pair(), pair(x_m=0.2, names=('caster_a', 'caster_b'))), 'geometry'),
        ((pair(), ball('front', 0.1)), 'geometry'),
        ((pair(kind='revolute', inside=ENDLESS), ball('front', 0.1)), 'geometry'),
    ],
)
def test_the_driven_pair_and_its_source(parts, source):
    description = described(robot(base(), *parts))
    assert (description.left.joint, description.right.joint) == USUAL
    assert found(description, 'left wheel joint') == (USUAL[0], source)


def test_of_two_axles_the_larger_wheels_drive_with_a_warning():
    description = described(robot(base(), pair(), pair(0.02, x_m=0.2, names=('a', 'b'))))
    assert description.left.joint == USUAL[0]
    assert "and 'a_joint', 'b_joint' to be casters" in ' '.join(description.warnings)


def test_wheels_on_the_wrong_side_are_swapped_and_unknown_ones_passed_over_with_a_warning():
    swapped = plugin('libgazebo_ros_diff_drive.so', leftJoint=USUAL[1], rightJoint=USUAL[0])
    assert joints_of(usual(swapped)) == USUAL
    assert f'names {USUAL[1]!r} as left joint, which is on the right' in described(usual(swapped)).warnings[0]
    description = described(robot(base(), pair(names=('right_wheel', 'left_wheel')), ball('caster', 0.1)))
    assert 'is x forward' in description.warnings[0]
    # A joint of another robot is passed over.
    description = described(usual(plugin('libgazebo_ros_diff_drive.so', leftJoint='wheel_l', rightJoint='wheel_r')))
    assert description.left.joint == USUAL[0]
    assert "names joint 'wheel_l', which the robot does not have" in description.warnings[0]


def omni(name, bearing_rad):
    """A wheel on a circle, its axle through the middle."""
    x_m, y_m = 0.15 * math.cos(bearing_rad), 0.15 * math.sin(bearing_rad)
    axis = f'{math.cos(bearing_rad)} {math.sin(bearing_rad)} 0'
    return wheel(name, x_m, y_m, axis=axis, origin=f'rpy="0 1.5707963267948966 {bearing_rad}"')


ROTORS = ''.join(wheel(f'rotor_{n}', n, z_m=1, axis='0 0 1', origin='xyz="0 0 0"') for n in range(2))
ALONG_X = {'axis': '1 0 0', 'origin': 'rpy="0 1.5707963267948966 0"'}


@pytest.mark.parametrize(
    ('parts', 'expected'),
    [
        ((ball('foot', 0.1),), 'given a robot without wheels (joints that turn without end: none; '),
        ((ROTORS,), "(joints that turn without end: 'rotor_0_joint', 'rotor_1_joint'; a wheel has a level axis"),
        ((wheel('only'),), "given the wheels 'only_joint' ("),
        ((pair(), wheel('middle')), 'two or more driven axles'),
        ((wheel('front'), wheel('rear', x_m=-0.3)), "given the wheels 'front_joint', 'rear_joint' ("),
        (
            [wheel(name, x_m, **ALONG_X) for name, x_m in (('a', 0.15), ('b', -0.15))],
            'apart by (0.300, 0.000, 0.000) m',
        ),
        ((pair(), FRONT_PAIR), 'two or more driven axles (skid-steer, or mecanum)'),
        ((pair(), STEERED, ROLL), "a steered wheel (tricycle or Ackermann) (joint 'swivel' turns wheel 'front'"),
        ((pair(), SWIVEL, ROLL, transmission('swivel', 'PositionJointInterface')), "joint 'swivel' turns wheel"),
        ([omni(name, bearing * math.pi / 3) for name, bearing in zip('abc', (0, 2, 4))], 'an omnidirectional robot'),
        ([omni(name, bearing * math.pi / 4) for name, bearing in zip('abcd', (1, 3, 5, 7))], 'an omnidirectional'),
        ((pair(), plugin('libgazebo_ros_ackermann_drive.so')), 'tricycle or Ackermann'),
        ((pair(), plugin('libskid_steer_drive.so', leftFrontJoint='a', rightFrontJoint='b')), "drive.so with 'a', 'b'"),
        ((pair(), plugin('gz-sim-mecanum-drive-system', front_left_joint='a')), 'omnidirectional'),
        ((pair(), FRONT_PAIR, DRIVE, FRONT_DRIVE), "plugins with 'a_joint', 'b_joint', 'left_wheel_joint', 'right_"),
    ],
)
def test_a_robot_of_another_kind_is_named(parts, expected):
    with pytest.raises(ConfigError) as caught:
        described(robot(base(), *parts))
    assert expected in str(caught.value) and '\n' not in str(caught.value)


def test_the_error_ends_with_a_robot_file_that_overrides_it(tmp_path):
    path = tmp_path / "it's.urdf"
    path.write_text(robot(base(), pair(), pair(x_m=0.2, names=('a: b', "c'd"))), encoding='utf-8')
    with pytest.raises(ConfigError) as caught:
        describe(RobotSource(path))
    (tmp_path / 'mine.yaml').write_text(str(caught.value).split('a robot file (YAML): ')[1], encoding='utf-8')
    mine = set_up_robot(load_robot_file('mine.yaml', tmp_path, tmp_path, {})).description
    assert (mine.left.joint, mine.right.joint) == USUAL


def test_the_user_may_drive_two_wheels_of_a_skid_steer_robot_and_the_others_slide():
    description = described(robot(base(), pair(), FRONT_PAIR), left_joint='a_joint', right_joint='b_joint')
    assert description.axle_x_m == pytest.approx(0.2)
    assert [contact.name for contact in description.contacts] == ['left_wheel', 'right_wheel']
    assert "'left_wheel_joint', 'right_wheel_joint' slide without friction" in description.warnings[0]
