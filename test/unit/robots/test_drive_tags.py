"""The drives that plugins and transmissions name, and robots whose plugins have tags as published ones.

The tags are those of gazebo_plugins (ROS 1 and ROS 2), gz-sim, gz_ros2_control, hector_gazebo, and of the plugins of
Kobuki, Create, TurtleBot, Husky, Segway, Prius and others.
"""

import re

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.robots.driven_wheels import (
    DIFFERENTIAL,
    SKID_STEER,
    commanded_joints,
    drive_plugins,
    rolling_wheels,
)
from urdf_texts import ball, base, described, joint, link, pair, plugin, robot, transmission, tree_of, usual, wheel


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
SKID = table("""
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
STEERED = table("""
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


def swivel(name, x_m, y_m):
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
    swivel('caster_left', 0.12, 0.08) + swivel('caster_right', 0.12, -0.08),
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


DRIVES = {'two': TWO_WHEELS, 'skid': SKID, 'car': STEERED, 'tricycle': STEERED}
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


LEFT, RIGHT = 'left_wheel_joint', 'right_wheel_joint'


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


def test_several_wheels_on_a_side_are_a_skid_steer_drive():
    lefts, rights = (LEFT, 'rear_left_joint'), (RIGHT, 'rear_right_joint')
    corners = dict(zip(('leftFrontJoint', 'leftRearJoint', 'rightFrontJoint', 'rightRearJoint'), (*lefts, *rights)))
    rear = pair(x_m=-0.2, names=('rear_left', 'rear_right'))
    (tags,) = drives(rear, plugin('libmaker.so', **corners))
    assert (tags.kind, tags.left_joints, tags.right_joints) == (SKID_STEER, lefts, rights)


def test_transmissions_and_ros2_control_show_which_joints_are_commanded_and_how():
    control = ''.join(
        f'<joint name="{name}"><command_interface name="{kind}"/><state_interface name="position"/></joint>'
        for name, kind in ((RIGHT, 'velocity'), ('ball_caster_joint', 'position'), ('missing', 'velocity'))
    )
    tree = tree_of(usual(transmission(LEFT), f'<ros2_control name="r" type="system">{control}</ros2_control>'))
    assert commanded_joints(tree) == (LEFT, RIGHT)
    assert commanded_joints(tree, position=True) == ('ball_caster_joint',)
