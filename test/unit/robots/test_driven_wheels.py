"""Which two wheels drive: by the user, plugins, transmissions, or geometry; and robots of other kinds.

The tags of plugins are those of gazebo_plugins (ROS 1 and ROS 2), gz-sim, gz_ros2_control, hector_gazebo, and of the
plugins of Kobuki, Create, TurtleBot, Husky, Segway, Prius and others.
"""

import math
import re

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.describing import describe
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.robots.driven_wheels import DIFFERENTIAL, commanded_joints, drive_plugins, rolling_wheels
from diff_encoder_sim.robots.robot_file import load_robot_file, set_up_robot
from urdf_texts import (
    ball,
    base,
    described,
    found,
    joint,
    link,
    pair,
    plugin,
    robot,
    transmission,
    tree_of,
    usual,
    wheel,
)

USUAL = LEFT, RIGHT = 'left_wheel_joint', 'right_wheel_joint'
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
        ((pair(), plugin('libskid_steer_drive.so', leftFrontJoint='a', rightFrontJoint='b')), "drive.so with 'a', 'b'"),
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


def table(text):
    """The (tag, text) pairs of words TAG=TEXT by their files; the lines of a plugin after its first are indented."""
    rows = (row.split() for row in re.split(r'\n(?=\S)', text.strip()))
    return {file: [tuple(word.split('=', 1)) for word in words] for file, *words in rows}


# Plugins of two driven wheels: file, then their tags. {left} and {right} stand for wheel joints.
TWO_WHEELS = table("""
libgazebo_ros_diff_drive.so leftJoint={left} rightJoint={right} wheelSeparation=0.3 wheelDiameter=0.1 wheelTorque=5
  wheelAcceleration=1.8 publishWheelTF=false publishWheelJointState=true legacyMode=false odometrySource=world
libgazebo_ros2_diff_drive.so left_joint={left} right_joint={right} wheel_separation=0.3 wheel_diameter=0.1
  max_wheel_torque=20 max_wheel_acceleration=1.0 num_wheel_pairs=1 publish_wheel_tf=true
gz-sim-diff-drive-system left_joint={left} right_joint={right} wheel_separation=0.3 wheel_radius=0.05
  max_linear_acceleration=1 min_linear_acceleration=-1 max_angular_acceleration=2 max_linear_velocity=0.5
libignition-gazebo-diff-drive-system.so left_joint={left} right_joint={right} wheel_separation=0.3 wheel_radius=0.05
libgazebo_ros_kobuki.so left_wheel_joint_name={left} right_wheel_joint_name={right} wheel_separation=.3
  wheel_diameter=0.1 torque=1.0 cliff_sensor_left_name=cliff_sensor_left wheel_drop_left_sensor_name=wheel_drop_left
libgazebo_ros_create.so left_wheel_joint={left} right_wheel_joint={right} wheel_separation=.26 wheel_diameter=0.066
  front_castor_joint=front_castor_joint rear_castor_joint=rear_castor_joint
libDiffDrivePlugin.so left_joint={left} right_joint={right} torque=5
libsegway_rmp_plugin.so leftWheelJoint={left} rightWheelJoint={right} wheelTrack=0.3
libmaker_base.so leftDriveJointName={left} rightDriveJointName={right} trackWidth=0.3 tread=0.3
transmissions
geometry
""")
# Plugins of four wheels or more, and of steered ones; where two wheels are named they are the rear ones. {fl} to {rr}
# stand for the joints of four wheels, {steer_left} and {steer_right} for the joints above steered wheels.
SKID_DRIVES = table("""
libgazebo_ros_skid_steer_drive.so leftFrontJoint={fl} rightFrontJoint={fr} leftRearJoint={rl} rightRearJoint={rr}
libSkidSteerDrivePlugin.so left_front={fl} right_front={fr} left_rear={rl} right_rear={rr} MaxForce=5.0
libhusky_gazebo_plugins.so backLeftJoint={rl} backRightJoint={rr} frontLeftJoint={fl} frontRightJoint={fr}
gz-sim-diff-drive-system left_joint={fl} left_joint={rl} right_joint={fr} right_joint={rr} wheel_separation=0.3
libgazebo_ros_control.so robotNamespace=/jackal robotSimType=gazebo_ros_control/DefaultRobotHWSim
libgazebo_ros_planar_move.so commandTopic=cmd_vel odometryTopic=odom robotBaseFrame=base_link
libmaker_base.so left_joint={rl} right_joint={rr} wheel_radius=0.05
gz-sim-mecanum-drive-system front_left_joint={fl} front_right_joint={fr} back_left_joint={rl} back_right_joint={rr}
libgz-sim8-mecanum-drive-system front_left_joint={fl} front_right_joint={fr}
libmecanum_plugin.so frontLeftWheelJoint={fl} frontRightWheelJoint={fr} rearLeftWheelJoint={rl}
transmissions
""")
STEERED_DRIVES = table("""
libgazebo_ros_ackermann_drive.so front_left_joint={fl} front_right_joint={fr} rear_left_joint={rl}
  rear_right_joint={rr} left_steering_joint={steer_left} right_steering_joint={steer_right}
gz-sim-ackermann-steering-system left_joint={fl} left_joint={rl} right_joint={fr} right_joint={rr}
  left_steering_joint={steer_left} right_steering_joint={steer_right} steering_limit=0.5
libgazebo_ros_tricycle_drive.so steeringJoint={steer_left} actuatedWheelJoint={fl} encoderWheelLeftJoint={rl}
libPriusHybridPlugin.so front_left_wheel={fl} front_right_wheel={fr} back_left_wheel={rl} back_right_wheel={rr}
  front_left_wheel_steering={steer_left} front_right_wheel_steering={steer_right}
libgazebo_ros_diff_drive.so leftJoint={rl} rightJoint={rr} wheelSeparation=0.3
libgazebo_ros_control.so robotNamespace=/ ackermann_prop=false
transmissions
""")
# What stands next to them, in the same plugin or in another one: nothing of it drives a wheel.
OTHERS = table("""others
  publishLeftWheelTF=true left_wheel_topic=left/cmd right_joint_state_topic=right/states left_joint_damping=0.1
  left_wheel_link={left_link} right_wheel_link={right_link} left_wheel_pid=10,0.1,0 right_wheel_radius=0.05
  leftWheelOffset=0.15 copyright_wheel=ACME left_encoder_ppr=1024 left_wheel_name=left right_wheel_name=right
  left_bumper_joint=left_bumper_joint right_bumper_joint=right_bumper_joint leftArmJoint=left_joint
  rightArmJoint=right_joint left_caster_joint=caster_left_joint right_caster_joint=caster_right_joint
  steering_mode=differential steer_topic=/steer power_steering=off skid_detection=true omni_camera=camera_link
  ackermann_msgs=false mecanum=false jointName={left},{right} leftCameraName=left left_sonar_topic=/sonar/left
  left_finger_joint=left_finger_joint right_finger_joint=right_finger_joint wheel_drop_left_joint=drop_left_joint
""")['others']
# Files and names of plugins that drive nothing.
DECOYS = (
    ('libdisplay.so', 'power_steering_display'),
    ('libasteroid_steerless.so', 'controller'),
    ('libomni_camera.so', 'omni'),
    ('libskid_detector.so', 'skid_detector'),
    ('libgazebo_ros_planar_move.so', 'object_controller'),
)
# Names of the left wheel's link and joint: a robot's own, and those that are equal.
NAMES = (
    ('wheel_left_link', 'wheel_left_joint'),
    ('left_wheel', 'left_wheel'),
    ('left_wheel_link', 'base_to_left_wheel'),
    ('LeftWheel', 'LeftWheelHinge'),
    ('drivewhl_left', 'drivewhl_left_rev'),
    ('left_wheel', 'left joint'),
)
SIDES = (('left', 0.15), ('right', -0.15))


def free_caster(name, x_m, y_m):
    fork = link(f'{name}_fork')
    fork += joint(f'{name}_swivel', f'{name}_fork', f'{x_m} {y_m} 0.06', 'continuous', axis='0 0 1')
    return fork + wheel(name, -0.01, 0.0, 0.02, parent=f'{name}_fork', z_m=-0.04)


DISC = '<cylinder radius="0.03" length="0.02"/>'


def arms(kind, suffix=''):
    """Parts on the left and on the right that turn or move: no wheels."""
    arm = 'arm' + suffix
    return ''.join(
        link(f'{side}_{arm}', DISC) + joint(f'{side}{suffix}_joint', f'{side}_{arm}', f'0 {y} 0.5', kind)
        for side, y in (('left', 0.1), ('right', -0.1))
    )


CASTERS = (
    ball('front_ball', 0.1),
    free_caster('caster_left', 0.12, 0.08) + free_caster('caster_right', 0.12, -0.08),
    wheel('caster_left', 0.12, 0.08, 0.02) + wheel('caster_right', 0.12, -0.08, 0.02),
    ball('front_ball', 0.1) + ball('rear_ball', -0.1),
)
EXTRAS = arms('continuous') + arms('prismatic', '_finger')
EXTRAS += link('rotor', DISC) + joint('rotor_joint', 'rotor', '0 0 0.3', 'continuous', axis='0 0 1')


def variant(number, kind, drive, tags):
    """A URDF with the driven joints; without any if it skids, steers or has mecanum wheels."""
    links, commanded = ('rear_left', 'rear_right'), ('rear_left_joint', 'rear_right_joint')
    parts = [pair(x_m=-0.2, names=links)]
    if kind == 'two':
        names = NAMES[number % len(NAMES)]
        links, commanded = ((name, name.replace('left', 'right').replace('Left', 'Right')) for name in names)
        wheels = pair(names=links)
        for name, joint_name in zip(links, commanded):
            wheels = wheels.replace(f'name="{name}_joint"', f'name="{joint_name}"')
        parts = [wheels, CASTERS[number % len(CASTERS)], EXTRAS]
    texts = dict(zip(('left', 'right', 'left_link', 'right_link', 'rl', 'rr'), (*commanded, *links, *commanded)))
    texts.update(fl='front_left_joint', fr='front_right_joint', steer_left='knuckle_left')
    if kind == 'skid':
        parts.append(pair(x_m=0.2, names=('front_left', 'front_right')))
        commanded += ('front_left_joint', 'front_right_joint')
    limits = '<limit lower="-0.6" upper="0.6" effort="1" velocity="1"/>'
    for side, y_m in {'car': SIDES, 'tricycle': (('left', 0.0),)}.get(kind, ()):
        knuckle = texts['steer_right'] = f'knuckle_{side}'
        parts.append(link(knuckle) + joint(knuckle, knuckle, f'0.2 {y_m} 0.1', 'revolute', axis='0 0 1', inside=limits))
        parts.append(wheel(f'front_{side}', parent=knuckle, z_m=-0.05))
        # A differential drive of the rear wheels is one with casters, unless something commands the front ones.
        if 'diff' in drive or drive == 'transmissions':
            parts.append(transmission(knuckle, 'PositionJointInterface'))
    parts += map(transmission, commanded if drive == 'transmissions' else ())
    for file, name, own_tags in ((drive, 'base_controller', tags), *((*decoy, []) for decoy in DECOYS)):
        inside = ''.join(f'<{tag}>{text.format(**texts)}</{tag}>' for tag, text in [*own_tags, *OTHERS])
        parts.append(f'<gazebo><plugin name="{name}" filename="{file}">{inside}</plugin></gazebo>')
    return robot(base(), *parts), commanded if kind == 'two' else ()


DRIVES = {'two': TWO_WHEELS, 'skid': SKID_DRIVES, 'car': STEERED_DRIVES, 'tricycle': STEERED_DRIVES}
CASES = [(kind, *drive) for kind, drives in DRIVES.items() for drive in drives.items()]


@pytest.mark.parametrize(('number', 'case'), [*enumerate(CASES)], ids=[f'{kind} {drive}' for kind, drive, _ in CASES])
def test_a_robot_is_accepted_by_its_wheels_and_not_by_words_in_tags(number, case):
    text, driven = variant(number, *case)
    if driven:
        description = described(text)
        assert (description.left.joint, description.right.joint) == driven
        return
    with pytest.raises(ConfigError, match='given a robot|given an omnidirectional'):
        described(text)


def drives(*parts):
    tree = tree_of(usual(*parts))
    return drive_plugins(tree, rolling_wheels(tree))


@pytest.mark.parametrize(
    ('filename', 'names'),
    [
        ('libgazebo_ros_diff_drive.so', 'leftJoint rightJoint wheelSeparation wheelDiameter wheelTorque'),
        ('libgazebo_ros_diff_drive.so', 'left_joint right_joint wheel_separation wheel_diameter max_wheel_torque'),
        ('libmaker.so', 'left_wheel_joint_name right_wheel_joint_name wheel_separation wheel_diameter torque'),
    ],
)
def test_a_drive_plugin_gives_joints_and_sizes_whatever_it_calls_them(filename, names):
    (tags,) = drives(plugin(filename, **dict(zip(names.split(), (f' {LEFT} ', RIGHT, 0.3, 0.1, 5)))))
    assert (tags.source, tags.kind, tags.left_joints + tags.right_joints) == (filename, DIFFERENTIAL, (LEFT, RIGHT))
    assert (tags.separation_m, tags.diameter_m, tags.limits) == (0.3, 0.1, {'wheel_torque': 5.0})


LIMITS = {'max_linear_speed': 0.5, 'max_angular_acceleration': 2.0}


@pytest.mark.parametrize(
    ('numbers', 'diameter_m', 'limits'),
    [((0.05, 0.5, 2.0), 0.1, LIMITS), *(((number,) * 3, None, {}) for number in ('nan', 0, 1e300))],
)
def test_a_radius_limits_of_the_body_and_numbers_that_no_robot_has(numbers, diameter_m, limits):
    given = dict(zip(('wheel_radius', 'max_linear_velocity', 'max_angular_acceleration'), numbers))
    (tags,) = drives(plugin('gz-sim-diff-drive-system', left_joint=LEFT, right_joint=RIGHT, **given))
    assert (tags.diameter_m, tags.limits) == (diameter_m, limits)


def test_transmissions_and_ros2_control_show_which_joints_are_commanded_and_how():
    control = ''.join(
        f'<joint name="{name}"><command_interface name="{kind}"/><state_interface name="position"/></joint>'
        for name, kind in ((RIGHT, 'velocity'), ('ball_caster_joint', 'position'), ('missing', 'velocity'))
    )
    tree = tree_of(usual(transmission(LEFT), f'<ros2_control name="r" type="system">{control}</ros2_control>'))
    assert commanded_joints(tree) == (LEFT, RIGHT)
    assert commanded_joints(tree, position=True) == ('ball_caster_joint',)
