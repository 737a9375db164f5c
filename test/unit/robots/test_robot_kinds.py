"""Robots that are no differential drive get one line: what they are, what is modelled, how to say otherwise."""

import math

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.describing import describe
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.robot_file import load_robot_file
from diff_encoder_sim.robots.robot_setup import set_up_robot
from urdf_texts import RADIUS_M, ball, base, described, joint, link, pair, plugin, robot, transmission, usual, wheel

SIX = pair() + pair(x_m=0.2, names=('fl', 'fr')) + pair(x_m=-0.2, names=('rl', 'rr'))
STEERED_FORK = link('fork') + joint(
    'steering',
    'fork',
    '0.3 0 0.1',
    'revolute',
    axis='0 0 1',
    inside='<limit lower="-0.6" upper="0.6" effort="1" velocity="1"/>',
)
FRONT = wheel('front', parent='fork', z_m=RADIUS_M - 0.1)


def omni(name, bearing_rad):
    """A wheel on a circle, its axle through the middle."""
    x_m, y_m = 0.15 * math.cos(bearing_rad), 0.15 * math.sin(bearing_rad)
    axis = f'{math.cos(bearing_rad)} {math.sin(bearing_rad)} 0'
    return wheel(name, x_m, y_m, axis=axis, origin=f'rpy="0 1.5707963267948966 {bearing_rad}"')


def complaint_about(text, **choices):
    with pytest.raises(ConfigError) as caught:
        described(text, **choices)
    assert '\n' not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(
    ('parts', 'expected'),
    [
        (
            (ball('foot', 0.1),),
            'made.urdf: given a robot without wheels: none of its 1 joints is continuous; allowed: two',
        ),
        ((wheel('only'),), "made.urdf: given one wheel, joint 'only_joint'; allowed: two driven wheels on one axle"),
        (
            (pair(), wheel('middle')),
            "given three or more wheels on one axle: 'left_wheel_joint', 'right_wheel_joint', 'middle_joint'; allowed",
        ),
        (
            (wheel('front'), wheel('rear', x_m=-0.3)),
            "given wheels that are not on one axle or not of one size: 'front_joint', 'rear_joint'",
        ),
        ((pair(), pair(x_m=0.2, names=('a', 'b'))), 'a robot with two or more driven axles (skid-steer, or mecanum)'),
        (
            (SIX,),
            "of one size: 'left_wheel_joint', 'right_wheel_joint', 'fl_joint', 'fr_joint', 'rl_joint', 'rr_joint'",
        ),
        (
            (pair(), STEERED_FORK, FRONT),
            "a steered wheel (tricycle or Ackermann) (joint 'steering' turns wheel 'front'",
        ),
        (
            tuple(omni(name, bearing * math.pi / 3) for name, bearing in (('a', 0), ('b', 2), ('c', 4))),
            'an omnidirectional robot, whose wheels have rollers (the axles',
        ),
        (
            tuple(omni(name, bearing * math.pi / 4) for name, bearing in (('a', 1), ('b', 3), ('c', 5), ('d', 7))),
            'an omnidirectional robot',
        ),
    ],
)
def test_a_robot_of_another_kind_is_named(parts, expected):
    assert expected in complaint_about(robot(base(), *parts))


def test_rotors_of_a_drone_are_no_wheels():
    rotors = (
        link(f'rotor_{n}', '<cylinder radius="0.1" length="0.01"/>')
        + joint(f'rotor_{n}_joint', f'rotor_{n}', f'{x} {y} 0.1', 'continuous', axis='0 0 1')
        for n, (x, y) in enumerate([(0.2, 0.2), (0.2, -0.2), (-0.2, 0.2), (-0.2, -0.2)])
    )
    text = complaint_about(robot(base(), *rotors))
    assert "('rotor_0_joint', 'rotor_1_joint', 'rotor_2_joint', 'rotor_3_joint') none has a level axis" in text


@pytest.mark.parametrize(
    ('drive', 'expected'),
    [
        (
            plugin('libgazebo_ros_skid_steer_drive.so', leftFrontJoint='a', rightFrontJoint='b'),
            "plugin libgazebo_ros_skid_steer_drive.so with 'a', 'b'); modelled are two driven wheels on one axle; ",
        ),
        (plugin('libgazebo_ros_ackermann_drive.so'), 'tricycle or Ackermann'),
        (plugin('gz-sim-mecanum-drive-system', front_left_joint='a', front_right_joint='b'), 'omnidirectional'),
    ],
)
def test_a_plugin_that_drives_otherwise_is_named(drive, expected):
    assert expected in complaint_about(usual(drive))


def test_the_error_ends_with_a_robot_file_that_overrides_it(tmp_path):
    path = tmp_path / "it's.urdf"
    path.write_text(robot(base(), pair(), pair(x_m=0.2, names=('a: b', "c'd"))), encoding='utf-8')
    with pytest.raises(ConfigError) as caught:
        describe(RobotSource(path))
    (tmp_path / 'mine.yaml').write_text(str(caught.value).split('a robot file (YAML): ')[1], encoding='utf-8')
    mine = set_up_robot(load_robot_file('mine.yaml', tmp_path, tmp_path, {})).description
    assert (mine.left.joint, mine.right.joint) == ('left_wheel_joint', 'right_wheel_joint')


def test_two_plugins_with_a_pair_each_are_a_skid_steer_robot():
    drives = [
        plugin('libgazebo_ros_diff_drive.so', leftJoint=f'{left}_joint', rightJoint=f'{right}_joint')
        for left, right in (('left_wheel', 'right_wheel'), ('a', 'b'))
    ]
    text = complaint_about(robot(base(), pair(), pair(x_m=0.2, names=('a', 'b')), *drives))
    assert "plugins with 'a_joint', 'b_joint', 'left_wheel_joint', 'right_wheel_joint'" in text


def test_a_plugin_that_moves_any_robot_without_wheels_does_not_matter():
    assert described(usual(plugin('libgazebo_ros_planar_move.so'))).left.joint == 'left_wheel_joint'


def test_the_user_may_drive_two_wheels_of_a_skid_steer_robot_and_the_others_slide():
    description = described(
        robot(base(), pair(), pair(x_m=0.2, names=('a', 'b'))), left_joint='a_joint', right_joint='b_joint'
    )
    assert description.axle_x_m == pytest.approx(0.2)
    assert [contact.name for contact in description.contacts] == ['left_wheel', 'right_wheel']
    assert description.warnings[0] == (
        "the wheels of 'left_wheel_joint', 'right_wheel_joint' slide without friction: "
        'what they do in turns is not modelled'
    )


def test_a_commanded_swivel_steers_and_a_free_one_is_a_caster():
    swivel = link('fork') + joint('swivel', 'fork', '0.3 0 0.1', 'continuous', axis='0 0 1')
    text = robot(base(), pair(), swivel, FRONT)
    assert described(text).left.joint == 'left_wheel_joint'
    commanded = transmission('swivel', 'PositionJointInterface')
    assert "joint 'swivel' turns wheel 'front'" in complaint_about(text.replace('</robot>', f'{commanded}</robot>'))
