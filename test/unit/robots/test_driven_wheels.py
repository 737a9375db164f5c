"""Which two wheels drive, told by the user, plugins, transmissions, or geometry."""

import math

import pytest
import yaml

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.describing import describe
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.driven_wheels import commanded_joints, controllers, controllers_in, drive_plugins
from diff_encoder_sim.robots.robot_file import load_robot_file
from diff_encoder_sim.robots.robot_setup import set_up_robot
from diff_encoder_sim.robots.rolling_wheels import rolling_wheels
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
    tree_of,
    usual,
    wheel,
)

WHEELS = ('left_wheel_joint',), ('right_wheel_joint',)


def drives(text):
    tree = tree_of(text)
    return drive_plugins(tree, rolling_wheels(tree))


def only_drive(*parts):
    (tags,) = drives(usual(*parts))
    return tags


@pytest.mark.parametrize(
    ('filename', 'names', 'joint'),
    [
        ('libgazebo_ros_diff_drive.so', 'leftJoint rightJoint wheelSeparation wheelDiameter wheelTorque', '{}'),
        (
            'libgazebo_ros_diff_drive.so',
            'left_joint right_joint wheel_separation wheel_diameter max_wheel_torque',
            '{}',
        ),
        ('libmaker.so', 'left_wheel_joint_name right_wheel_joint_name wheel_separation wheel_diameter torque', ' {} '),
    ],
)
def test_a_drive_plugin_tells_joints_and_sizes_whatever_it_calls_them(filename, names, joint):
    values = joint.format('left_wheel_joint'), joint.format('right_wheel_joint'), 0.3, 0.1, 5
    tags = dict(zip(names.split(), values))
    found = only_drive(plugin(filename, **tags))
    assert (found.source, found.kind) == (filename, 'differential')
    assert (found.left_joints, found.right_joints) == WHEELS
    assert (found.separation_m, found.diameter_m, found.limits) == (0.3, 0.1, {'wheel_torque': 5.0})


def test_gazebo_sim_tells_the_radius_and_limits_of_the_body():
    found = only_drive(
        '<gazebo><plugin name="gz::sim::systems::DiffDrive" filename="gz-sim-diff-drive-system">'
        '<left_joint>left_wheel_joint</left_joint><right_joint>right_wheel_joint</right_joint>'
        '<wheel_radius>0.05</wheel_radius><max_linear_velocity>0.5</max_linear_velocity>'
        '<max_angular_acceleration>2</max_angular_acceleration></plugin></gazebo>'
    )
    assert found.diameter_m == 0.1
    assert found.limits == {'max_linear_speed': 0.5, 'max_angular_acceleration': 2.0}


@pytest.mark.parametrize('number', ['1e300', 'nan', 'inf', '-1', '0', '1e-300', ''])
def test_a_number_that_no_robot_has_is_ignored(number):
    tags = dict.fromkeys(('wheelSeparation', 'wheelDiameter', 'wheelTorque', 'wheelAcceleration'), number)
    drive = plugin('libx_diff_drive.so', leftJoint='left_wheel_joint', rightJoint='right_wheel_joint', **tags)
    found = only_drive(drive)
    assert (found.separation_m, found.diameter_m, found.limits) == (None, None, {})


@pytest.mark.parametrize('number', ['1.0e+300', '.nan', '.inf', '-1', '0', 'wide'])
def test_a_number_that_no_robot_has_is_ignored_in_a_controller(number):
    tags = only_controller(ROS_1.replace('0.3', number).replace('0.05', number).replace('0.8', number))
    assert (tags.separation_m, tags.diameter_m, tags.limits) == (None, None, {'max_angular_speed': 1.5})


def test_several_wheels_on_a_side_are_a_skid_steer_drive():
    rear = pair(x_m=-0.2, names=('rear_left', 'rear_right'))
    joints = {'left': ('left_wheel_joint', 'rear_left_joint'), 'right': ('right_wheel_joint', 'rear_right_joint')}
    several = ''.join(f'<{side}_joint>{name}</{side}_joint>' for side, names in joints.items() for name in names)
    found = only_drive(rear, f'<gazebo><plugin filename="libgazebo_ros_diff_drive.so">{several}</plugin></gazebo>')
    assert (found.kind, found.left_joints, found.right_joints) == ('skid-steer', joints['left'], joints['right'])
    corners = zip(('leftFront', 'leftRear', 'rightFront', 'rightRear'), (*joints['left'], *joints['right']))
    found = only_drive(rear, plugin('libmaker.so', **{f'{corner}Joint': name for corner, name in corners}))
    assert (found.kind, found.left_joints, found.right_joints) == ('skid-steer', joints['left'], joints['right'])


@pytest.mark.parametrize(
    ('filename', 'tags'),
    [
        ('libgazebo_ros_joint_state_publisher.so', {'jointName': 'left_wheel_joint, right_wheel_joint'}),
        ('libgazebo_ros_imu.so', {'bodyName': 'left_wheel'}),
        ('libgazebo_ros_control.so', {'robotNamespace': '/'}),
        ('libgazebo_ros_planar_move.so', {'robotBaseFrame': 'base_link'}),
    ],
)
def test_other_plugins_drive_nothing(filename, tags):
    assert drives(usual(plugin(filename, **tags))) == ()


def test_transmissions_and_ros2_control_tell_what_is_commanded_and_how():
    text = usual(
        '<transmission name="t"><joint name="left_wheel_joint"><hardwareInterface>hardware_interface/'
        'VelocityJointInterface</hardwareInterface></joint></transmission>'
        '<ros2_control name="r" type="system"><joint name="right_wheel_joint"><command_interface name="velocity"/>'
        '<state_interface name="position"/></joint><joint name="ball_caster_joint"><command_interface name="position"/>'
        '</joint><joint name="missing"><command_interface name="velocity"/></joint></ros2_control>'
    )
    assert commanded_joints(tree_of(text)) == ('left_wheel_joint', 'right_wheel_joint')
    assert commanded_joints(tree_of(text), position=True) == ('ball_caster_joint',)


def test_a_controller_of_the_first_gazebo_tells_the_same():
    found = only_drive(
        '<gazebo><controller:differential_position2d xmlns:controller="any" name="c">'
        '<leftJoint>left_wheel_joint</leftJoint><rightJoint>right_wheel_joint</rightJoint><wheelSeparation>0.3</wheelSeparation>'
        '</controller:differential_position2d></gazebo>'
    )
    assert (found.source, found.left_joints, found.separation_m) == ('differential_position2d', WHEELS[0], 0.3)


ROS_1 = """
mobile_base_controller:
  type: diff_drive_controller/DiffDriveController
  left_wheel: left_wheel_joint
  right_wheel: right_wheel_joint
  wheel_separation: 0.3
  wheel_separation_multiplier: 1.1
  wheel_radius: 0.05
  linear: {x: {has_velocity_limits: true, max_velocity: 0.8, has_acceleration_limits: false, max_acceleration: 2.0}}
  angular: {z: {max_velocity: 1.5}}
"""
ROS_2 = """
diff_drive_controller:
  ros__parameters:
    left_wheel_names: [left_wheel_joint]
    right_wheel_names: [right_wheel_joint]
    wheel_separation: 0.3
    wheel_radius: 0.05
    linear.x.max_velocity: 0.8
    linear.x.has_velocity_limits: true
"""


def controllers_of(path, *parts):
    tree = tree_of(usual(plugin('libgazebo_ros2_control.so', parameters=path), *parts))
    return controllers(tree, rolling_wheels(tree))


def only_controller(text):
    (tags,) = controllers_in(yaml.safe_load(text), 'control.yaml')
    return tags


def test_a_controller_of_ros_1_tells_sizes_and_the_limits_that_hold():
    tags = only_controller(ROS_1)
    assert (tags.left_joints, tags.right_joints) == (('left_wheel_joint',), ('right_wheel_joint',))
    assert (round(tags.separation_m, 9), tags.diameter_m) == (0.33, 0.1)
    assert tags.limits == {'max_linear_speed': 0.8, 'max_angular_speed': 1.5}


def test_a_controller_of_ros_2_tells_the_same_in_dotted_keys():
    tags = only_controller(ROS_2)
    assert (tags.kind, tags.separation_m, tags.diameter_m) == ('differential', 0.3, 0.1)
    assert tags.limits == {'max_linear_speed': 0.8}


def test_a_file_that_a_plugin_names_is_read_if_it_is_there(tmp_path):
    path = tmp_path / 'control.yaml'
    path.write_text(ROS_2)
    for name in (str(path), f'file://{path}', f' {path} '):
        assert [tags.source for tags in controllers_of(name)] == ['control.yaml']
    for content in ('not: [closed', '- a list', ''):
        path.write_text(content)
        assert controllers_of(path) == ()
    assert controllers_of('/nowhere.yaml') == ()


def test_only_joints_that_carry_wheels_count(tmp_path):
    path = tmp_path / 'control.yaml'
    path.write_text(ROS_2.replace('[left_wheel_joint]', '[left_wheel_joint, a_joint, ball_caster_joint]'))
    (tags,) = controllers_of(path)
    assert (tags.kind, tags.left_joints) == ('differential', ('left_wheel_joint',))
    (tags,) = controllers_of(path, pair(x_m=0.2, names=('a', 'b')))
    assert (tags.kind, tags.left_joints) == ('skid-steer', ('left_wheel_joint', 'a_joint'))


def test_a_controller_tells_the_drive(tmp_path):
    path = tmp_path / 'control.yaml'
    path.write_text(ROS_2)
    description = described(usual(plugin('libgazebo_ros2_control.so', parameters=path)))
    assert found(description, 'left wheel joint') == ('left_wheel_joint', 'control.yaml')
    assert description.drive_limits['max_linear_speed'] == 0.8


DRIVE = plugin('libgazebo_ros_diff_drive.so', leftJoint='left_wheel_joint', rightJoint='right_wheel_joint')


def joints_of(text, **choices):
    description = described(text, **choices)
    return description.left.joint, description.right.joint


def test_the_user_goes_before_the_plugin_and_may_name_one_wheel_only():
    other = pair(x_m=0.2, names=('a', 'b'))
    text = usual(other, DRIVE)
    assert joints_of(text) == ('left_wheel_joint', 'right_wheel_joint')
    assert joints_of(text, left_joint='a_joint', right_joint='b_joint') == ('a_joint', 'b_joint')
    assert joints_of(text, right_joint='b_joint') == ('a_joint', 'b_joint')


@pytest.mark.parametrize(
    ('choices', 'complaint'),
    [
        ({'left_joint': 'lft_wheel_joint'}, "given 'lft_wheel_joint' as left wheel joint, which is missing"),
        ({'left_joint': 'ball_caster_joint', 'right_joint': 'right_wheel_joint'}, 'which is fixed'),
        ({'left_joint': 'right_wheel_joint', 'right_joint': 'left_wheel_joint'}, 'left wheel left of the right one'),
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


def test_an_arm_and_a_spinning_scanner_are_no_wheels():
    arm = link('hand', sphere(0.05)) + joint('elbow', 'hand', '0 0 0.5', 'continuous')
    scanner = link('rotor', sphere(0.05)) + joint('spin', 'rotor', '0 0 0.06', 'continuous', axis='0 0 1')
    description = described(usual(arm, scanner))
    assert description.left.joint == 'left_wheel_joint'
    assert 'joints held still at zero: elbow, spin (continuous)' in description.notes


SIX = pair() + pair(x_m=0.2, names=('fl', 'fr')) + pair(x_m=-0.2, names=('rl', 'rr'))
TURN = '<limit lower="-0.6" upper="0.6" effort="1" velocity="1"/>'
STEERED_FORK = link('fork') + joint('steering', 'fork', '0.3 0 0.1', 'revolute', axis='0 0 1', inside=TURN)
ROTORS = tuple(
    wheel(f'rotor_{n}', x_m, z_m=0.1, axis='0 0 1', origin='xyz="0 0 0"') for n, x_m in enumerate((-0.2, 0.2))
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
        ((ball('foot', 0.1),), 'given a robot without wheels: none of its 1 joints is continuous'),
        (ROTORS, "('rotor_0_joint', 'rotor_1_joint') none has a level axis"),
        ((wheel('only'),), "given one wheel, joint 'only_joint'; allowed: two driven wheels on one axle"),
        ((pair(), wheel('middle')), 'given three or more wheels on one axle'),
        ((wheel('front'), wheel('rear', x_m=-0.3)), 'given wheels that are not on one axle or not of one size'),
        ((pair(), pair(x_m=0.2, names=('a', 'b'))), 'two or more driven axles (skid-steer, or mecanum)'),
        ((SIX,), "'left_wheel_joint', 'right_wheel_joint', 'fl_joint', 'fr_joint', 'rl_joint', 'rr_joint'"),
        (
            (pair(), STEERED_FORK, FRONT),
            "a steered wheel (tricycle or Ackermann) (joint 'steering' turns wheel 'front'",
        ),
        ([omni(name, bearing * math.pi / 3) for name, bearing in zip('abc', (0, 2, 4))], 'an omnidirectional robot'),
        (
            [omni(name, bearing * math.pi / 4) for name, bearing in zip('abcd', (1, 3, 5, 7))],
            'an omnidirectional robot',
        ),
    ],
)
def test_a_robot_of_another_kind_is_named(parts, expected):
    assert expected in complaint_about(robot(base(), *parts))


@pytest.mark.parametrize(
    ('drive', 'expected'),
    [
        (
            plugin('libgazebo_ros_skid_steer_drive.so', leftFrontJoint='a', rightFrontJoint='b'),
            "drive.so with 'a', 'b'",
        ),
        (plugin('libgazebo_ros_ackermann_drive.so'), 'tricycle or Ackermann'),
        (plugin('libgazebo_ros_tricycle_drive.so', steeringJoint='a'), 'tricycle or Ackermann'),
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


def test_two_coaxial_wheels_drive_without_any_hint():
    description = described(robot(base(), pair(names=('a', 'b')), ball('front', 0.1)))
    assert (description.left.joint, description.right.joint) == ('a_joint', 'b_joint')
    assert found(description, 'left wheel joint') == ('a_joint', 'geometry')
