"""Encoded messages: rosbags reads them, and would write the same bytes."""

import math

import numpy as np
import pytest

import message_values as values
from diff_encoder_sim.base.se2 import quat_xyzw_from_yaw
from diff_encoder_sim.drives import message_encoders as encoders
from diff_encoder_sim.drives.message_encoders import UNKNOWN_VARIANCE, ModelStatesEncoder, SentGoal
from diff_encoder_sim.navigation.navigator_inputs import GoalStatus
from message_checks import header, planar, read, time

SENT = SentGoal('/navigation_trial_node', 3, 5_610_000_000)
GOAL_ID = {'stamp': time(SENT.stamp_ns), 'id': '/navigation_trial_node-3-5.610'}


def vector(x, y, z):
    return {'x': x, 'y': y, 'z': z}


def covariance(planar, axes, other):
    matrix = np.diag([other] * 6)
    matrix[np.ix_(axes, axes)] = planar
    return matrix.ravel().tolist()


def twist(linear, angular):
    return {'linear': vector(*linear), 'angular': vector(*angular)}


def test_clock_and_command(rng):
    now_ns, (linear_mps, angular_radps) = values.stamp_ns(rng), values.floats(rng, 2)
    assert read(encoders.encode_clock(now_ns), 'rosgraph_msgs/msg/Clock') == {'clock': time(now_ns)}
    message = read(encoders.encode_command(linear_mps, angular_radps), 'geometry_msgs/msg/Twist')
    assert message == twist((linear_mps, 0.0, 0.0), (0.0, 0.0, angular_radps))


def test_joints(rng):
    joints, sample, speeds_radps = values.joints(rng), values.encoder_sample(rng), list(values.floats(rng, 2))
    about = {'header': header(joints.stamp_ns, ''), 'name': list(joints.names), 'effort': []}
    angles = {'position': list(joints.angles_rad), 'velocity': list(joints.speeds_radps)}
    assert read(encoders.encode_joint_state(joints), 'sensor_msgs/msg/JointState') == {**about, **angles}
    raw = encoders.encode_wheel_speeds(joints.stamp_ns, speeds_radps, joints.names)
    assert read(raw, 'sensor_msgs/msg/JointState') == {**about, 'position': [], 'velocity': speeds_radps}
    assert read(encoders.encode_encoder_pulse(sample, values.JOINTS), 'diff_encoder_sim/msg/EncoderPulse') == {
        'header': header(sample.stamp_ns, ''),
        'name': list(values.JOINTS),
        'pulses': [sample.left_pulses, sample.right_pulses],
    }


def test_odometry(rng):
    estimate = values.estimate(rng)._replace(lateral_velocity_mps=0.125)
    linear, angular = (estimate.linear_velocity_mps, 0.125, 0.0), (0.0, 0.0, estimate.angular_velocity_radps)
    of_pose = covariance(estimate.pose_covariance, [0, 1, 5], UNKNOWN_VARIANCE)
    of_twist = covariance(estimate.twist_covariance, [0, 5], UNKNOWN_VARIANCE)
    assert read(encoders.encode_odometry(estimate, 'odom', 'base_link'), 'nav_msgs/msg/Odometry') == {
        'header': header(estimate.stamp_ns, 'odom'),
        'child_frame_id': 'base_link',
        'pose': {'pose': planar(estimate.base_pose_in_odom), 'covariance': of_pose},
        'twist': {'twist': twist(linear, angular), 'covariance': of_twist},
    }


def test_stamped_poses(rng):
    pose, of_amcl, now_ns = values.pose(rng), values.covariance(rng, 3), values.stamp_ns(rng)
    about = {'header': header(now_ns, 'map')}
    raw = encoders.encode_pose_stamped(pose, now_ns, 'map')
    assert read(raw, 'geometry_msgs/msg/PoseStamped') == {**about, 'pose': planar(pose)}
    raw = encoders.encode_pose_with_covariance(pose, of_amcl, now_ns, 'map')
    expected = {'pose': planar(pose), 'covariance': covariance(of_amcl, [0, 1, 5], 0.0)}
    assert read(raw, 'geometry_msgs/msg/PoseWithCovarianceStamped') == {**about, 'pose': expected}
    found = read(encoders.encode_pose_array(np.array([pose, pose]), now_ns, 'map'), 'geometry_msgs/msg/PoseArray')
    assert found == {**about, 'poses': [planar(pose)] * 2}


def test_transforms(rng):
    pose, now_ns = values.pose(rng), values.stamp_ns(rng)
    translation, rotation = values.floats(rng, 3), values.quat_xyzw(rng)
    raw = encoders.encode_tf(
        encoders.encode_transform(pose, now_ns, 'map', 'odom'),
        encoders.encode_spatial_transform(translation, rotation, now_ns + 1, 'base_link', 'left_wheel'),
    )
    moved = planar(pose)
    moved = {'translation': moved['position'], 'rotation': moved['orientation']}
    turned = {'translation': vector(*translation), 'rotation': dict(zip('xyzw', rotation))}
    assert read(raw, 'tf2_msgs/msg/TFMessage')['transforms'] == [
        {'header': header(now_ns, 'map'), 'child_frame_id': 'odom', 'transform': moved},
        {'header': header(now_ns + 1, 'base_link'), 'child_frame_id': 'left_wheel', 'transform': turned},
    ]


def test_scan(rng):
    scan = values.scan(rng)
    message = read(encoders.encode_scan(scan, 'laser', 0.1), 'sensor_msgs/msg/LaserScan')
    assert (message.pop('header'), message.pop('intensities')) == (header(scan.stamp_ns, 'laser'), [])
    assert message.pop('ranges') == scan.ranges_m.astype(np.float32).tolist()
    assert message == pytest.approx(
        {
            'angle_min': scan.angle_min_rad,
            'angle_max': scan.bearings_rad()[-1],
            'angle_increment': scan.angle_increment_rad,
            'time_increment': 0.0,
            'scan_time': 0.1,
            'range_min': 0.15,
            'range_max': 6.0,
        },
        abs=1e-6,
    )


def test_goal(rng):
    pose, now_ns = values.pose(rng), values.stamp_ns(rng)
    message = read(encoders.encode_goal(SENT, pose, now_ns, 'map'), 'move_base_msgs/msg/MoveBaseActionGoal')
    target = {'header': header(now_ns, 'map'), 'pose': planar(pose)}
    assert message == {'header': header(SENT.stamp_ns, ''), 'goal_id': GOAL_ID, 'goal': {'target_pose': target}}


@pytest.mark.parametrize(
    ('status', 'number'), [(GoalStatus.PREEMPTED, 2), (GoalStatus.SUCCEEDED, 3), (GoalStatus.ABORTED, 4)]
)
def test_result(status, number):
    message = read(encoders.encode_result(SENT, status, 'wörtlich', 7), 'move_base_msgs/msg/MoveBaseActionResult')
    assert message['header'] == header(7, '')
    assert message['status'] == {'goal_id': GOAL_ID, 'status': number, 'text': 'wörtlich'}


def test_map_and_its_metadata(rng):
    grid, now_ns = values.grid(rng), values.stamp_ns(rng)
    message = read(encoders.encode_map(grid, now_ns, 'map'), 'nav_msgs/msg/OccupancyGrid')
    assert message['header'] == header(now_ns, 'map') and message['data'] == grid.cells.ravel().tolist()
    assert message['info'] == read(encoders.encode_map_metadata(grid, now_ns), 'nav_msgs/msg/MapMetaData')
    assert message['info'] == {
        'map_load_time': time(now_ns),
        'resolution': pytest.approx(grid.resolution_m),
        'height': grid.cells.shape[0],
        'width': grid.cells.shape[1],
        'origin': planar(grid.origin),
    }


def test_model_states(rng):
    world, body = values.world(rng), values.body(rng)
    models = ModelStatesEncoder(world, 'alto')
    models.encode(values.body(rng))  # leaves no trace in the next one
    message = read(models.encode(body), 'gazebo_msgs/msg/ModelStates')
    assert message['name'] == ['floor', 'walls', 'pillars', 'alto']
    for model, pose in zip(world.models, message['pose']):
        place, (cos_yaw, sin_yaw) = model.pose_in_world[:3, 3], model.pose_in_world[:2, 0].tolist()
        turned = dict(zip('xyzw', quat_xyzw_from_yaw(math.atan2(sin_yaw, cos_yaw))))
        assert pose == {'position': vector(*place.tolist()), 'orientation': pytest.approx(turned)}
    assert message['twist'][:3] == [twist((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))] * 3
    assert message['pose'][3] == {'position': vector(*body[0]), 'orientation': dict(zip('xyzw', body[1]))}
    assert message['twist'][3] == twist(body[2], body[3])
