"""Values of a trial, drawn at random, in our encoding and as messages of rosbags."""

import math

import numpy as np
from rosbags.typesys import Stores

from diff_encoder_sim.base.imu import ImuParams, ImuSample
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D, quat_xyzw_from_yaw
from diff_encoder_sim.drives import message_encoders as encoders
from diff_encoder_sim.drives.message_encoders import UNKNOWN_VARIANCE, ModelStatesEncoder
from diff_encoder_sim.drives.typestore import message_store
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
from diff_encoder_sim.navigation.navigator_inputs import GoalStatus
from diff_encoder_sim.simulation.state import BodyState, JointStates
from diff_encoder_sim.simulation.world import Model, World
from diff_encoder_sim.wheels.covariance import PlanarCovariance
from diff_encoder_sim.wheels.odometry import OdometryEstimate, TwistCovariance
from diff_encoder_sim.wheels.report_link import EncoderSample

SENT = encoders.SentGoal('/navigation_trial_node', 3, 5_610_000_000)
JOINTS = ('left_wheel_joint', 'right_wheel_joint')


def random_stamp_ns(rng):
    return int(rng.integers(0, 2**31)) * 10**9 + int(rng.integers(0, 10**9))


def random_floats(rng, count):
    return tuple((rng.normal(size=count) * 10.0 ** rng.integers(-9, 9)).tolist())


def random_pose(rng):
    return Pose2D(*random_floats(rng, 3))


def random_quat_xyzw(rng):
    quat = rng.normal(size=4)
    return tuple((quat / np.linalg.norm(quat)).tolist())


def random_covariance(rng, size):
    root = rng.normal(size=(size, size))
    return root @ root.T


def random_body(rng):
    return BodyState(random_floats(rng, 3), random_quat_xyzw(rng), random_floats(rng, 3), random_floats(rng, 3))


def random_world(rng):
    return World('room', [Model(name, _upright_pose(rng), []) for name in ('floor', 'walls', 'pillars')])


def _upright_pose(rng):
    yaw_rad = rng.uniform(-np.pi, np.pi)
    full = np.eye(4)
    full[:2, :2] = [[np.cos(yaw_rad), -np.sin(yaw_rad)], [np.sin(yaw_rad), np.cos(yaw_rad)]]
    full[:3, 3] = rng.normal(size=3)
    return full


def made(kind, *fields):
    """A message of package/Type."""
    return message_store(Stores.ROS1_NOETIC).types[kind.replace('/', '/msg/')](*fields)


def raw(kind, *fields):
    return bytes(message_store(Stores.ROS1_NOETIC).serialize_ros1(made(kind, *fields), kind.replace('/', '/msg/')))


def time(stamp_ns):
    return made('builtin_interfaces/Time', *divmod(stamp_ns, 10**9))


def header(stamp_ns, frame=''):
    return made('std_msgs/Header', 0, time(stamp_ns), frame)


def pose_of(xyz, quat, kind='Pose', place='Point'):
    parts = made(f'geometry_msgs/{place}', *xyz), made('geometry_msgs/Quaternion', *quat)
    return made(f'geometry_msgs/{kind}', *parts)


def planar(pose, **kinds):
    quat = 0.0, 0.0, math.sin(0.5 * pose.yaw_rad), math.cos(0.5 * pose.yaw_rad)
    return pose_of((pose.x_m, pose.y_m, 0.0), quat, **kinds)


def twist(linear, angular):
    return made('geometry_msgs/Twist', *(made('geometry_msgs/Vector3', *each) for each in (linear, angular)))


def uncertain(kind, mean, planar, axes, other):
    matrix = np.diag([other] * 6)
    matrix[np.ix_(axes, axes)] = planar
    return made(f'geometry_msgs/{kind}WithCovariance', mean, matrix.ravel())


def encoded_and_expected(rng):
    """Yield bytes of our own, and the type and fields of the message."""
    now_ns, pose, (linear_mps, angular_radps) = random_stamp_ns(rng), random_pose(rng), random_floats(rng, 2)
    about, none = header(now_ns, 'map'), np.zeros(0)
    yield encoders.encode_string('räder'), 'std_msgs/String', 'räder'
    yield encoders.encode_clock(now_ns), 'rosgraph_msgs/Clock', time(now_ns)
    vectors = (made('geometry_msgs/Vector3', *each) for each in ((linear_mps, 0.0, 0.0), (0.0, 0.0, angular_radps)))
    yield encoders.encode_command(linear_mps, angular_radps), 'geometry_msgs/Twist', *vectors

    joints = JointStates(random_stamp_ns(rng), JOINTS, random_floats(rng, 2), random_floats(rng, 2))
    sample, speeds_radps = EncoderSample(now_ns, *rng.integers(-(2**62), 2**62, 2).tolist()), random_floats(rng, 2)
    named = header(joints.stamp_ns), list(joints.names)
    angles = np.array(joints.angles_rad), np.array(joints.speeds_radps)
    yield encoders.encode_joint_state(joints), 'sensor_msgs/JointState', *named, *angles, none
    encoded = encoders.encode_wheel_speeds(joints.stamp_ns, speeds_radps, joints.names)
    yield encoded, 'sensor_msgs/JointState', *named, none, np.array(speeds_radps), none
    named = header(sample.stamp_ns), list(JOINTS)
    encoded = encoders.encode_encoder_pulse(sample, JOINTS)
    yield encoded, 'diff_encoder_sim/EncoderPulse', *named, np.array([sample.left_pulses, sample.right_pulses])

    covariances = PlanarCovariance(*random_floats(rng, 6)), TwistCovariance(*random_floats(rng, 3))
    estimate = OdometryEstimate(now_ns, pose, linear_mps, angular_radps, *covariances, lateral_velocity_mps=0.125)
    moved = twist((estimate.linear_velocity_mps, 0.125, 0.0), (0.0, 0.0, estimate.angular_velocity_radps))
    of_base = planar(estimate.base_pose_in_odom)
    of_pose = uncertain('Pose', of_base, estimate.of_pose.matrix(), [0, 1, 5], UNKNOWN_VARIANCE)
    linear, both, angular = estimate.of_twist
    of_twist = uncertain('Twist', moved, [[linear, both], [both, angular]], [0, 5], UNKNOWN_VARIANCE)
    fields = header(estimate.stamp_ns, 'odom'), 'base_link', of_pose, of_twist
    yield encoders.encode_odometry(estimate, 'odom', 'base_link'), 'nav_msgs/Odometry', *fields

    yield encoders.encode_pose_stamped(pose, now_ns, 'map'), 'geometry_msgs/PoseStamped', about, planar(pose)
    of_amcl = random_covariance(rng, 3)
    encoded = encoders.encode_pose_with_covariance(pose, of_amcl, now_ns, 'map')
    of_pose = uncertain('Pose', planar(pose), of_amcl, [0, 1, 5], 0.0)
    yield encoded, 'geometry_msgs/PoseWithCovarianceStamped', about, of_pose

    spatial, kinds = (random_floats(rng, 3), random_quat_xyzw(rng)), {'kind': 'Transform', 'place': 'Vector3'}
    encoded = encoders.encode_tf(
        encoders.encode_transform(pose, now_ns, 'map', 'odom'),
        encoders.encode_spatial_transform(*spatial, now_ns + 1, 'base_link', 'left_wheel'),
    )
    first = header(now_ns, 'map'), 'odom', planar(pose, **kinds)
    second = header(now_ns + 1, 'base_link'), 'left_wheel', pose_of(*spatial, **kinds)
    yield encoded, 'tf2_msgs/TFMessage', [made('geometry_msgs/TransformStamped', *each) for each in (first, second)]

    ranges_m = rng.uniform(0.0, 7.0, rng.integers(1, 2000))
    ranges_m[ranges_m > 6.0] = np.inf
    scan = Scan(now_ns, -np.pi, 2.0 * np.pi / len(ranges_m), 0.15, 6.0, ranges_m)
    angles = scan.angle_min_rad, scan.bearings_rad()[-1], scan.angle_increment_rad
    fields = header(scan.stamp_ns, 'laser'), *angles, 0.0, 0.1, 0.15, 6.0, scan.ranges_m.astype(np.float32)
    yield encoders.encode_scan(scan, 'laser', 0.1), 'sensor_msgs/LaserScan', *fields, np.zeros(0, np.float32)

    sensors = {'gyroscope': {'noise_density': 0.02, 'resolution': 0.1}, 'accelerometer': {'noise_density': 0.1}}
    imu = ImuParams.from_mapping({**sensors, 'rate': 50.0, 'frame': 'imu'}, '')
    measured = ImuSample(now_ns, random_floats(rng, 3), random_floats(rng, 3))
    vectors = [made('geometry_msgs/Vector3', *each) for each in measured[1:]]
    variances = 0.02**2 * 50.0 + 0.1**2 / 12.0, 0.1**2 * 50.0
    covariances = [np.diag([variance] * 3).ravel() for variance in variances]
    orientation = made('geometry_msgs/Quaternion', 0.0, 0.0, 0.0, 1.0), np.array([-1.0, *[0.0] * 8])
    fields = header(now_ns, 'imu'), *orientation, vectors[0], covariances[0], vectors[1], covariances[1]
    yield encoders.ImuEncoder(imu).encode(measured), 'sensor_msgs/Imu', *fields

    goal_id = made('actionlib_msgs/GoalID', time(SENT.stamp_ns), '/navigation_trial_node-3-5.610')
    goal = made('move_base_msgs/MoveBaseGoal', made('geometry_msgs/PoseStamped', about, planar(pose)))
    encoded = encoders.encode_goal(SENT, pose, now_ns, 'map')
    yield encoded, 'move_base_msgs/MoveBaseActionGoal', header(SENT.stamp_ns), goal_id, goal
    for status, number in ((GoalStatus.PREEMPTED, 2), (GoalStatus.SUCCEEDED, 3), (GoalStatus.ABORTED, 4)):
        ended = made('actionlib_msgs/GoalStatus', goal_id, number, 'wörtlich'), made('move_base_msgs/MoveBaseResult')
        encoded = encoders.encode_result(SENT, status, 'wörtlich', 7)
        yield encoded, 'move_base_msgs/MoveBaseActionResult', header(7), *ended

    grid = OccupancyGrid(rng.integers(-1, 101, rng.integers(1, 60, 2), dtype=np.int8), 0.05, pose)
    info = time(now_ns), grid.resolution_m, *grid.cells.shape[::-1], planar(grid.origin)
    yield encoders.encode_map_metadata(grid, now_ns), 'nav_msgs/MapMetaData', *info
    fields = about, made('nav_msgs/MapMetaData', *info), grid.cells.ravel()
    yield encoders.encode_map(grid, now_ns, 'map'), 'nav_msgs/OccupancyGrid', *fields

    world, body = random_world(rng), random_body(rng)
    models = ModelStatesEncoder(world, 'alto')
    models.encode(random_body(rng))  # leaves no trace in the next one
    yaws_rad = [math.atan2(*each.pose_in_world[1::-1, 0].tolist()) for each in world.models]
    places = [each.pose_in_world[:3, 3].tolist() for each in world.models]
    poses = [pose_of(place, quat_xyzw_from_yaw(yaw_rad)) for place, yaw_rad in zip(places, yaws_rad)]
    twists = [twist((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))] * 3 + [twist(*body[2:4])]
    names = ['floor', 'walls', 'pillars', 'alto']
    yield models.encode(body), 'gazebo_msgs/ModelStates', names, [*poses, pose_of(*body[:2])], twists
