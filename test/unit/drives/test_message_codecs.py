"""Encoded messages are the bytes that rosbags writes; decoded ones those of rosbags or our own, or torn."""

import math

import numpy as np
import pytest

import message_values as values
from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D, quat_xyzw_from_yaw
from diff_encoder_sim.drives import message_decoders as decoders
from diff_encoder_sim.drives import message_encoders as encoders
from diff_encoder_sim.drives.message_decoders import POSE_TYPES, JointDecoder, PoseDecoder
from diff_encoder_sim.drives.message_encoders import UNKNOWN_VARIANCE, ModelStatesEncoder
from diff_encoder_sim.drives.topics import ENCODER_PULSE_TYPE, JOINT_STATE_TYPE
from diff_encoder_sim.drives.typestore import noetic_store
from diff_encoder_sim.navigation.navigator_inputs import GoalStatus
from diff_encoder_sim.simulation.state import JointStates
from reencoding_drives import MAKERS, POSE

SENT = encoders.SentGoal('/navigation_trial_node', 3, 5_610_000_000)
NAMES = (('left', 'right'), ('a', 'bb', 'ccc', 'dddd', 'räder'), (), ('x',))


@pytest.fixture(name='rng', params=range(2))
def fixture_rng(request):
    return np.random.default_rng(request.param)


def made(kind, *fields):
    """A message of package/Type."""
    return noetic_store().types[kind.replace('/', '/msg/')](*fields)


def raw(kind, *fields):
    return bytes(noetic_store().serialize_ros1(made(kind, *fields), kind.replace('/', '/msg/')))


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
    now_ns, pose, (linear_mps, angular_radps) = values.stamp_ns(rng), values.pose(rng), values.floats(rng, 2)
    about, none = header(now_ns, 'map'), np.zeros(0)
    yield encoders.encode_clock(now_ns), 'rosgraph_msgs/Clock', time(now_ns)
    vectors = (made('geometry_msgs/Vector3', *each) for each in ((linear_mps, 0.0, 0.0), (0.0, 0.0, angular_radps)))
    yield encoders.encode_command(linear_mps, angular_radps), 'geometry_msgs/Twist', *vectors

    joints, sample, speeds_radps = values.joints(rng), values.encoder_sample(rng), values.floats(rng, 2)
    named = header(joints.stamp_ns), list(joints.names)
    angles = np.array(joints.angles_rad), np.array(joints.speeds_radps)
    yield encoders.encode_joint_state(joints), 'sensor_msgs/JointState', *named, *angles, none
    encoded = encoders.encode_wheel_speeds(joints.stamp_ns, speeds_radps, joints.names)
    yield encoded, 'sensor_msgs/JointState', *named, none, np.array(speeds_radps), none
    named = header(sample.stamp_ns), list(values.JOINTS)
    encoded = encoders.encode_encoder_pulse(sample, values.JOINTS)
    yield encoded, 'diff_encoder_sim/EncoderPulse', *named, np.array([sample.left_pulses, sample.right_pulses])

    estimate = values.estimate(rng)._replace(lateral_velocity_mps=0.125)
    moved = twist((estimate.linear_velocity_mps, 0.125, 0.0), (0.0, 0.0, estimate.angular_velocity_radps))
    of_base = planar(estimate.base_pose_in_odom)
    of_pose = uncertain('Pose', of_base, estimate.of_pose.matrix(), [0, 1, 5], UNKNOWN_VARIANCE)
    of_twist = uncertain('Twist', moved, estimate.of_twist.matrix(), [0, 5], UNKNOWN_VARIANCE)
    fields = header(estimate.stamp_ns, 'odom'), 'base_link', of_pose, of_twist
    yield encoders.encode_odometry(estimate, 'odom', 'base_link'), 'nav_msgs/Odometry', *fields

    yield encoders.encode_pose_stamped(pose, now_ns, 'map'), 'geometry_msgs/PoseStamped', about, planar(pose)
    of_amcl = values.covariance(rng, 3)
    encoded = encoders.encode_pose_with_covariance(pose, of_amcl, now_ns, 'map')
    of_pose = uncertain('Pose', planar(pose), of_amcl, [0, 1, 5], 0.0)
    yield encoded, 'geometry_msgs/PoseWithCovarianceStamped', about, of_pose

    spatial, kinds = (values.floats(rng, 3), values.quat_xyzw(rng)), {'kind': 'Transform', 'place': 'Vector3'}
    encoded = encoders.encode_tf(
        encoders.encode_transform(pose, now_ns, 'map', 'odom'),
        encoders.encode_spatial_transform(*spatial, now_ns + 1, 'base_link', 'left_wheel'),
    )
    first = header(now_ns, 'map'), 'odom', planar(pose, **kinds)
    second = header(now_ns + 1, 'base_link'), 'left_wheel', pose_of(*spatial, **kinds)
    yield encoded, 'tf2_msgs/TFMessage', [made('geometry_msgs/TransformStamped', *each) for each in (first, second)]

    scan = values.scan(rng)
    angles = scan.angle_min_rad, scan.bearings_rad()[-1], scan.angle_increment_rad
    fields = header(scan.stamp_ns, 'laser'), *angles, 0.0, 0.1, 0.15, 6.0, scan.ranges_m.astype(np.float32)
    yield encoders.encode_scan(scan, 'laser', 0.1), 'sensor_msgs/LaserScan', *fields, np.zeros(0, np.float32)

    goal_id = made('actionlib_msgs/GoalID', time(SENT.stamp_ns), '/navigation_trial_node-3-5.610')
    goal = made('move_base_msgs/MoveBaseGoal', made('geometry_msgs/PoseStamped', about, planar(pose)))
    encoded = encoders.encode_goal(SENT, pose, now_ns, 'map')
    yield encoded, 'move_base_msgs/MoveBaseActionGoal', header(SENT.stamp_ns), goal_id, goal
    for status, number in ((GoalStatus.PREEMPTED, 2), (GoalStatus.SUCCEEDED, 3), (GoalStatus.ABORTED, 4)):
        ended = made('actionlib_msgs/GoalStatus', goal_id, number, 'wörtlich'), made('move_base_msgs/MoveBaseResult')
        encoded = encoders.encode_result(SENT, status, 'wörtlich', 7)
        yield encoded, 'move_base_msgs/MoveBaseActionResult', header(7), *ended

    grid = values.grid(rng)
    info = time(now_ns), grid.resolution_m, *grid.cells.shape[::-1], planar(grid.origin)
    yield encoders.encode_map_metadata(grid, now_ns), 'nav_msgs/MapMetaData', *info
    fields = about, made('nav_msgs/MapMetaData', *info), grid.cells.ravel()
    yield encoders.encode_map(grid, now_ns, 'map'), 'nav_msgs/OccupancyGrid', *fields

    world, body = values.world(rng), values.body(rng)
    models = ModelStatesEncoder(world, 'alto')
    models.encode(values.body(rng))  # leaves no trace in the next one
    yaws_rad = [math.atan2(*each.pose_in_world[1::-1, 0].tolist()) for each in world.models]
    places = [each.pose_in_world[:3, 3].tolist() for each in world.models]
    poses = [pose_of(place, quat_xyzw_from_yaw(yaw_rad)) for place, yaw_rad in zip(places, yaws_rad)]
    twists = [twist((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))] * 3 + [twist(*body[2:4])]
    names = ['floor', 'walls', 'pillars', 'alto']
    yield models.encode(body), 'gazebo_msgs/ModelStates', names, [*poses, pose_of(*body[:2])], twists


def test_encoded_messages_are_those_of_rosbags(rng):
    cases = list(encoded_and_expected(rng))
    assert len(cases) == 17
    for encoded, kind, *fields in cases:
        assert encoded == raw(kind, *fields), kind


def test_encoded_particles(rng):
    pose, now_ns = values.pose(rng), values.stamp_ns(rng)
    found = encoders.encode_pose_array(np.array([pose, pose]), now_ns, 'map')
    expected = raw('geometry_msgs/PoseArray', header(now_ns, 'map'), [planar(pose)] * 2)
    assert found[:-112] == expected[:-112]
    assert np.frombuffer(found[-112:]) == pytest.approx(np.frombuffer(expected[-112:]), rel=1e-12)


def test_commands_and_speeds(rng):
    command = tuple(values.floats(rng, 2))
    assert decoders.decode_command(encoders.encode_command(*command)) == command
    with pytest.raises(InputFault, match='torn'):
        decoders.decode_command(encoders.encode_command(*command)[:-1])
    joints = JointStates(7, ('left', 'right'), (1.0, 2.0), (3.0, 4.0))
    assert decoders.decode_wheel_speeds(encoders.encode_joint_state(joints)) == (7, (3.0, 4.0))


@MAKERS
def test_joint_states_and_encoder_pulses(maker):
    rng, decoder = np.random.default_rng(1), JointDecoder(JOINT_STATE_TYPE, maker.is_ros2)
    for _ in range(200):
        names, stamp_ns = NAMES[rng.integers(len(NAMES))], int(rng.integers(0, 2**31 * 10**9))
        message = maker.joint_state(stamp_ns, rng.normal(size=rng.integers(0, 6)), names)
        message.header.frame_id = 'frame'[: rng.integers(6)]
        decoded = decoder.decode(maker.raw(message))
        assert (decoded.stamp_ns, decoded.names, list(decoded.values)) == (stamp_ns, names, message.position.tolist())
    decoder = JointDecoder(ENCODER_PULSE_TYPE, maker.is_ros2)
    for counts in ([2**63 - 1, -(2**63)], [5]):
        assert list(decoder.decode(maker.raw(maker.pulses(7, counts))).values) == counts


@MAKERS
@pytest.mark.parametrize('kind', POSE_TYPES)
def test_a_torn_message_is_a_fault_and_leaves_the_next_ones_as_they_are(maker, kind):
    raw = maker.raw(maker.pose(kind, 7, Pose2D(1.0, 2.0, 0.5)))
    learned, fresh = PoseDecoder(kind, maker.is_ros2), PoseDecoder(kind, maker.is_ros2)
    expected = learned.decode(raw)
    assert expected[:3] == (7, pytest.approx((1.0, 2.0, 0.5), abs=1e-15), 'map')
    pose_end = raw.index(np.array([1.0, 2.0, 0.0]).tobytes()) + 56
    for size in range(pose_end):
        for decoder in (learned, fresh):
            with pytest.raises(InputFault):
                decoder.decode(raw[:size])
        assert learned.decode(raw) == expected
    assert fresh.decode(raw) == expected


@MAKERS
@pytest.mark.parametrize('row', [(0.0, np.inf, 0.0), (0.0, 0.0, np.nan), (1e200, 0.0, 0.0)])
def test_a_pose_that_is_not_finite_is_a_fault(maker, row):
    with pytest.raises(InputFault, match=r'position .* expected finite numbers|is no rotation'):
        PoseDecoder(POSE, maker.is_ros2).decode(maker.raw(maker.pose(POSE, 7, Pose2D(*row))))


def test_the_state_of_one_model(rng):
    world, body = values.world(rng), values.body(rng)
    raw = ModelStatesEncoder(world, 'alto').encode(body)
    assert decoders.decode_model_state(raw, 'alto') == body
    assert decoders.decode_model_state(raw, 'walls').position_xyz_m == tuple(world.models[1].pose_in_world[:3, 3])
    with pytest.raises(InputFault, match="no model 'robot'; expected it among"):
        decoders.decode_model_state(raw, 'robot')
    for size in range(len(raw)):
        with pytest.raises(InputFault):
            decoders.decode_model_state(raw[:size], 'alto')


@pytest.mark.parametrize('raw', [b'', b'\0\0\0\0'])
def test_a_foreign_byte_order_is_a_fault(raw):
    with pytest.raises(InputFault, match='not little-endian CDR'):
        decoders.FieldReader(raw, is_cdr=True)
