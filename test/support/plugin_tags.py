"""Tags of simulator plugins and controllers, with texts as robots have them, and URDFs that are made with them.

The tags are those of gazebo_plugins (ROS 1 and ROS 2), gz-sim, gz_ros2_control, gazebo_ros_control and hector_gazebo,
and of the plugins of Kobuki, Create, TurtleBot, Husky, Jackal, MiR, Segway, Prius and others. {left} and {right} stand
for wheel joints, {left_link} and {right_link} for wheel links, {fl} to {rr} for the joints of four wheels, {steer_left}
and {steer_right} for the joints above steered wheels.
"""

import random
import re
from typing import NamedTuple, Tuple

from urdf_texts import RADIUS_M, ball, base, box, cylinder, joint, link, robot, sphere, transmission, wheel


def tags_in(text):
    """The (tag, text) pairs of words TAG=TEXT."""
    return [tuple(word.split('=', 1)) for word in text.split()]


def _table(text):
    """The tags of plugins by their files; the lines of a plugin after its first are indented."""
    rows = (row.split(None, 1) for row in re.split(r'\n(?=\S)', text.strip()))
    return {file: tags_in(tags) for file, tags in rows}


# Plugins of two driven wheels: file, then their tags.
TWO_WHEELS = _table("""
libgazebo_ros_diff_drive.so leftJoint={left} rightJoint={right} wheelSeparation=0.3 wheelDiameter=0.1 wheelTorque=5
  wheelAcceleration=1.8 publishWheelTF=false publishWheelJointState=true legacyMode=false odometrySource=world
libgazebo_ros2_diff_drive.so left_joint={left} right_joint={right} wheel_separation=0.3 wheel_diameter=0.1
  max_wheel_torque=20 max_wheel_acceleration=1.0 num_wheel_pairs=1 publish_wheel_tf=true odometry_source=1
gz-sim-diff-drive-system left_joint={left} right_joint={right} wheel_separation=0.3 wheel_radius=0.05
  odom_publish_frequency=20 max_linear_acceleration=1 min_linear_acceleration=-1 max_angular_acceleration=2
  min_angular_acceleration=-2 max_linear_velocity=0.5 min_linear_velocity=-0.5 max_angular_velocity=1
libignition-gazebo-diff-drive-system.so left_joint={left} right_joint={right} wheel_separation=0.3 wheel_radius=0.05
  tf_topic=/tf child_frame_id=base_link min_velocity=-0.5 max_velocity=0.5 min_jerk=-5 max_jerk=5
libgazebo_ros_kobuki.so left_wheel_joint_name={left} right_wheel_joint_name={right} wheel_separation=.3
  wheel_diameter=0.1 torque=1.0 velocity_command_timeout=0.6 cliff_sensor_left_name=cliff_sensor_left
  cliff_sensor_center_name=cliff_sensor_front cliff_sensor_right_name=cliff_sensor_right
  cliff_detection_threshold=0.04 bumper_name=bumpers imu_name=imu wheel_drop_left_sensor_name=wheel_drop_left
  wheel_drop_right_sensor_name=wheel_drop_right publish_tf=1
libgazebo_ros_create.so left_wheel_joint={left} right_wheel_joint={right} wheel_separation=.26 wheel_diameter=0.066
  base_geom=base_footprint_collision torque=1 front_castor_joint=front_castor_joint
  rear_castor_joint=rear_castor_joint node_namespace=create
libDiffDrivePlugin.so left_joint={left} right_joint={right} torque=5
libsegway_rmp_plugin.so leftWheelJoint={left} rightWheelJoint={right} wheelTrack=0.3
libmaker_base.so leftDriveJointName={left} rightDriveJointName={right} trackWidth=0.3 tread=0.3
""")
# Plugins of four wheels or more, and of steered ones; where two wheels are named they are the rear ones.
FOUR_WHEELS = _table("""
libgazebo_ros_skid_steer_drive.so leftFrontJoint={fl} rightFrontJoint={fr} leftRearJoint={rl} rightRearJoint={rr}
  wheelSeparation=0.3 wheelDiameter=0.1 torque=35 topicName=cmd_vel broadcastTF=true covariance_x=0.0001
libSkidSteerDrivePlugin.so left_front={fl} right_front={fr} left_rear={rl} right_rear={rr} MaxForce=5.0
libhusky_gazebo_plugins.so backLeftJoint={rl} backRightJoint={rr} frontLeftJoint={fl} frontRightJoint={fr}
gz-sim-diff-drive-system left_joint={fl} left_joint={rl} right_joint={fr} right_joint={rr} wheel_separation=0.3
libgazebo_ros_diff_drive.so num_wheel_pairs=2 left_joint={fl} right_joint={fr} left_joint={rl} right_joint={rr}
libgazebo_ros_control.so robotNamespace=/jackal robotSimType=gazebo_ros_control/DefaultRobotHWSim
libgazebo_ros_planar_move.so commandTopic=cmd_vel odometryTopic=odom odometryRate=20.0 robotBaseFrame=base_link
libgazebo_ros_force_based_move.so yaw_velocity_p_gain=100.0 x_velocity_p_gain=10000.0 y_velocity_p_gain=10000.0
libmaker_base.so left_joint={rl} right_joint={rr} wheel_radius=0.05
""")
MECANUM = _table("""
gz-sim-mecanum-drive-system front_left_joint={fl} front_right_joint={fr} back_left_joint={rl} back_right_joint={rr}
  wheel_separation=0.3 wheelbase=0.4 wheel_radius=0.05 min_acceleration=-5 max_acceleration=5
libgz-sim8-mecanum-drive-system front_left_joint={fl} front_right_joint={fr}
libmecanum_plugin.so frontLeftWheelJoint={fl} frontRightWheelJoint={fr} rearLeftWheelJoint={rl}
  rearRightWheelJoint={rr}
""")
STEERED = _table("""
libgazebo_ros_ackermann_drive.so front_left_joint={fl} front_right_joint={fr} rear_left_joint={rl}
  rear_right_joint={rr} left_steering_joint={steer_left} right_steering_joint={steer_right} max_steer=0.6458
  steering_wheel_joint=steering_joint max_steering_angle=7.85 left_steering_pid_gain=1500
  linear_velocity_pid_gain=1000
gz-sim-ackermann-steering-system left_joint={fl} left_joint={rl} right_joint={fr} right_joint={rr}
  left_steering_joint={steer_left} right_steering_joint={steer_right} kingpin_width=0.3 steering_limit=0.5
  wheel_base=0.4
libgazebo_ros_tricycle_drive.so steeringJoint={steer_left} actuatedWheelJoint={fl} encoderWheelLeftJoint={rl}
  encoderWheelRightJoint={rr} maxSteeringAngleSpeed=1 steeringAngleTolerance=0.01 wheelSpeedTolerance=0.01
libPriusHybridPlugin.so chassis=base_link front_left_wheel={fl} front_right_wheel={fr} back_left_wheel={rl}
  back_right_wheel={rr} front_left_wheel_steering={steer_left} front_right_wheel_steering={steer_right}
libmaker_car.so left_joint={rl} right_joint={rr} wheelbase=0.4
libgazebo_ros_diff_drive.so leftJoint={rl} rightJoint={rr} wheelSeparation=0.3
libgazebo_ros_control.so robotNamespace=/ ackermann_prop=false
""")
# What stands next to them, in the same plugin or in another one: nothing of it drives a wheel.
OTHERS = tags_in("""
publishLeftWheelTF=true publishRightWheelTF=true left_wheel_topic=left_wheel/cmd right_wheel_topic=right_wheel/cmd
left_joint_state_topic=left/joint_states right_joint_state_topic=right/joint_states left_wheel_link={left_link}
right_wheel_link={right_link} left_wheel_pid=10,0.1,0 right_wheel_pid=10,0.1,0 left_wheel_radius=0.05
right_wheel_radius=0.05 left_joint_damping=0.1 right_joint_damping=0.1 leftWheelOffset=0.15 rightWheelOffset=-0.15
copyright_wheel=ACME left_encoder_ppr=1024 right_encoder_ppr=1024 leftMotorId=1 rightMotorId=2
left_wheel_frame={left_link} right_wheel_frame={right_link} left_wheel_name=left right_wheel_name=right
left_motor_name=left_motor leftWheelTicksTopic=/lwheel rightWheelTicksTopic=/rwheel left_track=left_track
right_track=right_track wheel_left_effort_limit=5 is_left_inverted=false invert_right_wheel=1
left_wheel_radius_multiplier=1.0 right_wheel_radius_multiplier=1.0 left_bumper_joint=left_bumper_joint
right_bumper_joint=right_bumper_joint leftArmJoint=left_joint rightArmJoint=right_joint left_joint=left_joint
right_joint=right_joint left_caster_joint=caster_left_joint right_caster_joint=caster_right_joint
steering_mode=differential steer_topic=/steer power_steering=off skid_detection=true omni_camera=camera_link
ackermann_msgs=false mecanum=false holonomic=false
commandTopic=cmd_vel odometryTopic=odom odometryFrame=odom robotBaseFrame=base_footprint publishOdomTF=true
publishTf=true rosDebugLevel=na updateRate=50 alwaysOn=true robotNamespace=/ robotParam=robot_description
bodyName=base_link topicName=imu serviceName=imu_service gaussianNoise=0.0 frameName=imu_link xyzOffset=0,0,0
rpyOffset=0,0,0 updateRateHZ=50.0 initialOrientationAsReference=false jointName={left},{right} joint_name={left}
update_rate=30 publish_odom=true publish_odom_tf=true odometry_frame=odom robot_base_frame=base_link
odometry_topic=odom command_topic=cmd_vel covariance_yaw=0.01 covariance_y=0.0001 publish_distance=true
namespace=/robot remapping=cmd_vel:=cmd_vel frame_name=base_scan output_type=sensor_msgs/LaserScan cameraName=camera
imageTopicName=image_raw cameraInfoTopicName=camera_info hackBaseline=0.07 distortionK1=0.0 distortionT1=0.0 CxPrime=0
Cx=0.0 Cy=0.0 focalLength=0.0 pointCloudCutoff=0.5 leftCameraName=left rightCameraName=right
left_camera_frame=left_optical right_camera_frame=right_optical depthImageTopicName=depth/image_raw baseline=0.2
leftCamera=left_camera
velocityNoise=0 referenceLatitude=49.9 referenceLongitude=8.9 referenceHeading=0 referenceAltitude=0 offset=0
drift=0.0005,0.0005,0.0005 driftFrequency=0.0001 rateDrift=0.005 rateGaussianNoise=0.005 accelDrift=0.005
headingDrift=0.005 fov=0.5 radiation=ultrasound gaussianNoiseXYZ=0.005 min_range=0.9 max_range=130.0 gpu=false
numSamples=360 left_sonar_topic=/sonar/left right_sonar_topic=/sonar/right
topic=cmd_vel odom_topic=odom frame_id=odom dimensions=3 odom_covariance_topic=odom_cov
parameters=/nowhere/control.yaml controller_manager_name=controller_manager hold_joints=true
robot_param_node=robot_state_publisher robot_param=robot_description initial_velocity=0 p_gain=1 i_gain=0.1
d_gain=0.01 i_max=1 i_min=-1 cmd_max=1000 cmd_min=-1000 use_force_commands=false publish_link_pose=true
publish_collision_pose=false publish_sensor_pose=true use_pose_vector_msg=true static_publisher=true
render_engine=ogre2 link_name=base_link contact_topic=contact child_link=dock detachable_joint_topic=detach
wheel_drop_left=wheel_drop_left wheel_drop_right=wheel_drop_right wheel_drop_left_joint=drop_left_joint
wheel_drop_right_joint=drop_right_joint left_wheel_drop_topic=/wheel_drop/left cliff_front_left=cliff_front_left
cliff_side_right=cliff_side_right ir_intensity_left=ir_left bumper_left_topic=/bumper/left dock_topic=/dock
left_laser_frame=left_laser right_laser_frame=right_laser prefix=mir_ odom_frame=odom_comb model_name=robot
left_finger_joint=left_finger_joint right_finger_joint=right_finger_joint left_gripper=left_gripper
mimicJoint=right_finger_joint left_light=led_left rightLight=led_right leftEyeTopic=/eyes/left
front_left_ultrasound=us_1 rear_right_ultrasound=us_2
""")
# Files and names of plugins that drive nothing.
DECOYS = (
    ('libdisplay.so', 'power_steering_display'),
    ('libpower_steering_display.so', 'display'),
    ('libmaker_status.so', 'asteroid_steerless'),
    ('libasteroid_steerless.so', 'controller'),
    ('libomni_camera.so', 'omni'),
    ('libskid_detector.so', 'skid_detector'),
    ('libmaker_arm.so', 'arm_controller'),
    ('libgazebo_ros_joint_state_publisher.so', 'joint_state_publisher'),
    ('libgazebo_ros_imu_sensor.so', 'imu_plugin'),
    ('libgazebo_ros_planar_move.so', 'object_controller'),
    ('gz-sim-sensors-system', 'gz::sim::systems::Sensors'),
)


def all_tags():
    """The names of all tags in the tables."""
    tables = [tags for table in (TWO_WHEELS, FOUR_WHEELS, MECANUM, STEERED) for tags in table.values()]
    return {tag for tags in (*tables, OTHERS) for tag, _ in tags}


class Variant(NamedTuple):
    """A robot."""

    text: str  # URDF
    driven: Tuple[str, ...]  # the joints of its two wheels; () of a robot that is no differential drive


# Names of the left and the right wheel's link and joint: a robot's own, and those that are equal.
_NAMES = (
    ('wheel_left_link', 'wheel_left_joint'), ('left_wheel', 'left_wheel_joint'), ('left_wheel', 'left_wheel'),
    ('left_wheel_link', 'base_to_left_wheel'), ('LeftWheel', 'LeftWheelHinge'), ('drivewhl_left', 'drivewhl_left_rev'),
    ('left_wheel', 'left joint'),
)  # fmt: skip


def variant(number):
    """A robot of two wheels if the number is even, otherwise one that skids, steers or has mecanum wheels."""
    draw = random.Random(number)
    if number % 2 == 0:
        return _two_wheeled(draw)
    kind = ('skid', 'mecanum', 'steered')[number // 2 % 3]
    return _steered(draw) if kind == 'steered' else _four_wheeled(draw, kind)


def _two_wheeled(draw):
    left_link, left = draw.choice(_NAMES)
    right_link, right = (name.replace('left', 'right').replace('Left', 'Right') for name in (left_link, left))
    texts = {'left': left, 'right': right, 'left_link': left_link, 'right_link': right_link}
    parts = [_wheel(left_link, left, 0.0, 0.15), _wheel(right_link, right, 0.0, -0.15), draw.choice(_CASTERS)]
    parts += draw.sample(_EXTRAS, draw.randint(0, len(_EXTRAS)))
    drive = draw.choice([*TWO_WHEELS, 'transmissions', 'geometry'])
    if drive == 'transmissions':
        parts += [transmission(left), transmission(right)]
    elif drive != 'geometry':
        name = draw.choice(
            ['base_controller', 'skid_steer_drive_controller', 'ackermann', 'omni_base', 'asteroid_steerless']
        )
        name = name if 'diff' in drive.lower() else 'base_controller'
        parts.append(_plugin(drive, name, [*TWO_WHEELS[drive], *_others(draw, 12)], texts))
    return Variant(robot(base(), *parts, *_decoys(draw, texts)), (left, right))


def _four_wheeled(draw, kind):
    names = ('front_left', 'front_right', 'rear_left', 'rear_right')
    joints = [f'{name}_wheel_joint' for name in names]
    places = [(x_m, y_m) for x_m in (0.2, -0.2) for y_m in (0.15, -0.15)]
    parts = [_wheel(f'{name}_wheel', joint_name, *at) for name, joint_name, at in zip(names, joints, places)]
    if draw.random() < 0.3:
        parts += [
            _wheel('middle_left', 'middle_left_joint', 0, 0.15),
            _wheel('middle_right', 'middle_right_joint', 0, -0.15),
        ]
    texts = {**dict(zip(('fl', 'fr', 'rl', 'rr'), joints)), 'left': joints[2], 'right': joints[3]}
    texts.update(left_link='rear_left_wheel', right_link='rear_right_wheel')
    table = {**FOUR_WHEELS, **(MECANUM if kind == 'mecanum' else {})}
    drive = draw.choice([*table, 'transmissions'])
    if drive == 'transmissions':
        parts += map(transmission, joints)
    else:
        parts.append(_plugin(drive, 'base_controller', [*table[drive], *_others(draw, 12)], texts))
    return Variant(robot(base(), *parts, *_decoys(draw, texts)), ())


def _steered(draw):
    fronts = draw.choice([(('left', 0.15), ('right', -0.15)), (('left', 0.0),)])  # a car, a tricycle
    parts = [
        _wheel(f'rear_{side}_wheel', f'rear_{side}_joint', -0.2, y_m)
        for side, y_m in (('left', 0.15), ('right', -0.15))
    ]
    for side, y_m in fronts:
        limits = '<limit lower="-0.6" upper="0.6" effort="1" velocity="1"/>'
        parts.append(
            link(f'knuckle_{side}')
            + joint(f'knuckle_{side}', f'knuckle_{side}', f'0.2 {y_m} 0.1', 'revolute', axis='0 0 1', inside=limits)
        )
        parts.append(
            _wheel(f'front_{side}_wheel', f'front_{side}_joint', 0, 0, parent=f'knuckle_{side}', z_m=RADIUS_M - 0.1)
        )
    texts = {'fl': 'front_left_joint', 'fr': 'front_right_joint', 'rl': 'rear_left_joint', 'rr': 'rear_right_joint'}
    texts.update(
        steer_left='knuckle_left',
        steer_right=f'knuckle_{fronts[-1][0]}',
        left='rear_left_joint',
        right='rear_right_joint',
    )
    texts.update(left_link='rear_left_wheel', right_link='rear_right_wheel')
    drive = draw.choice([*STEERED, 'transmissions'])
    # A differential drive of the rear wheels is one with casters, unless something commands the front ones.
    if 'diff' in drive or drive == 'transmissions':
        parts += [transmission(f'knuckle_{side}', 'PositionJointInterface') for side, _ in fronts]
    if drive == 'transmissions':
        parts += [transmission('rear_left_joint'), transmission('rear_right_joint')]
    else:
        parts.append(_plugin(drive, 'base_controller', [*STEERED[drive], *_others(draw, 12)], texts))
    return Variant(robot(base(), *parts, *_decoys(draw, texts)), ())


def _wheel(name, joint_name, x_m, y_m, **given):
    return wheel(name, x_m, y_m, **given).replace(f'name="{name}_joint"', f'name="{joint_name}"')


def _plugin(filename, name, tags, texts):
    inside = ''.join(f'<{tag}>{text.format(**texts)}</{tag}>' for tag, text in tags)
    return f'<gazebo><plugin name="{name}" filename="{filename}">{inside}</plugin></gazebo>'


def _others(draw, count):
    return draw.sample(OTHERS, count)


def _decoys(draw, texts):
    return [_plugin(*draw.choice(DECOYS), _others(draw, draw.randint(0, 10)), texts) for _ in range(draw.randint(0, 4))]


def _swivel(name, x_m, y_m):
    fork = link(f'{name}_fork') + joint(
        f'{name}_swivel', f'{name}_fork', f'{x_m} {y_m} 0.06', 'continuous', axis='0 0 1'
    )
    return fork + wheel(name, -0.01, 0.0, 0.02, parent=f'{name}_fork', z_m=-0.04)


_CASTERS = (
    ball('front_ball', 0.1),
    _swivel('caster', 0.12, 0.0),
    _swivel('caster_left', 0.12, 0.08) + _swivel('caster_right', 0.12, -0.08),
    wheel('caster_left', 0.12, 0.08, 0.02) + wheel('caster_right', 0.12, -0.08, 0.02),
    ball('front_ball', 0.1) + ball('rear_ball', -0.1),
)
_EXTRAS = (
    # two arms whose shoulders turn without end about a level axis
    link('left_arm', cylinder(0.03, 0.1)) + joint('left_joint', 'left_arm', '0 0.1 0.5', 'continuous')
    + link('right_arm', cylinder(0.03, 0.1)) + joint('right_joint', 'right_arm', '0 -0.1 0.5', 'continuous'),
    link('left_finger', box(0.01, 0.01, 0.05)) + joint('left_finger_joint', 'left_finger', '0.1 0.02 0.4', 'prismatic')
    + link('right_finger', box(0.01, 0.01, 0.05))
    + joint('right_finger_joint', 'right_finger', '0.1 -0.02 0.4', 'prismatic'),
    link('rotor', cylinder(0.03)) + joint('rotor_joint', 'rotor', '0 0 0.3', 'continuous', axis='0 0 1'),
    link('drop_left') + joint('drop_left_joint', 'drop_left', '0 0.12 0.05', 'prismatic')
    + link('drop_right') + joint('drop_right_joint', 'drop_right', '0 -0.12 0.05', 'prismatic'),
    link('steering', sphere(0.02)) + joint('steering_joint', 'steering', '0.1 0 0.4', 'revolute', axis='0 0 1',
    inside='<limit lower="-1" upper="1" effort="1" velocity="1"/>'),
)  # fmt: skip
