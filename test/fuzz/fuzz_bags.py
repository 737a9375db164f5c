"""Bags whole in form and odd in content, for reencode, analyze and map_bag: NaN, jumps of the clock, names, shapes."""

import numpy as np

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.cli.map_bag import main as map_bag
from diff_encoder_sim.cli.reencode import main as reencode
from odd_values import odd_float, pick
from reencoding_drives import JOINTS, ROS1, ROS2, START_NS, TICK_NS, angles_rad, true_poses, write_ros1, write_ros2

COUNT = 101
LARGEST_STAMP_NS = (2**32 - 1) * 10**9  # of ROS 1
LARGEST_STAMP2_NS = (2**31 - 1) * 10**9
CLOCK_STEPS_NS = (0, -TICK_NS, 10**9, -(10**9), 10**12, -START_NS, 10**18, -(10**18))


def warm_up(folder):
    rows = _drive(ROS1, np.arange(COUNT) * TICK_NS + START_NS, angles_rad(COUNT))
    path = write_ros1(folder / 'good.bag', rows)
    _reencode(path, folder)
    _map(path, folder)


def run(rng, folder):
    stamps_ns = np.arange(COUNT) * TICK_NS + START_NS
    angles = angles_rad(COUNT)
    for _ in range(int(rng.integers(1, 4))):
        stamps_ns, angles = _odd_drive(rng, stamps_ns, angles)
    maker = ROS1 if rng.random() < 0.7 else ROS2
    if maker is ROS2:
        stamps_ns = np.minimum(stamps_ns, LARGEST_STAMP2_NS)
    rows = [odd_row(rng, row) for row in _drive(maker, stamps_ns, angles, rng)]
    path = write_ros1(folder / 'odd.bag', rows) if maker is ROS1 else write_ros2(folder / 'odd', rows)
    pick(rng, (_reencode, _reencode, _map))(path, folder)


def _odd_drive(rng, stamps_ns, angles):
    at = int(rng.integers(COUNT))
    stamps_ns, angles = stamps_ns.copy(), angles.copy()
    action = int(rng.integers(5))
    if action == 0:  # the clock steps
        stamps_ns[at:] += int(pick(rng, CLOCK_STEPS_NS))
    elif action == 1:  # one stamp is off
        stamps_ns[at] = int(pick(rng, (0, 1, LARGEST_STAMP_NS, stamps_ns[at - 1])))
    elif action == 2:  # some angles are odd
        angles[at : at + int(rng.integers(1, 20)), int(rng.integers(2))] = odd_float(rng)
    else:  # a counter that starts again, or nothing moves
        with np.errstate(invalid='ignore'):
            angles[at:] = odd_float(rng, 1000.0) + (angles[at:] if action == 3 else 0.0)
    return np.clip(stamps_ns, 0, LARGEST_STAMP_NS), angles


def _drive(maker, stamps_ns, angles, rng=None):
    """Joint states, true poses, odometry, scans and the scanner's mounting."""
    with np.errstate(all='ignore'):
        poses = true_poses(np.nan_to_num(angles, nan=0.0, posinf=0.0, neginf=0.0) % 1e3)
    mount = maker.transform(START_NS, IDENTITY, 'base_link', 'laser')
    rows = [('/tf_static', int(stamps_ns[0]), maker.tf(mount))]
    for tick, (stamp, angle, pose) in enumerate(zip(stamps_ns.tolist(), angles, poses)):
        rows.append(('/joint_states', stamp, maker.joint_state(stamp, angle, JOINTS)))
        if tick % 5 == 0:
            odd = pose if rng is None or rng.random() < 0.95 else Pose2D(odd_float(rng), pose.y_m, pose.yaw_rad)
            rows.append(('/world_pose', stamp, maker.pose('geometry_msgs/msg/PoseStamped', stamp, odd)))
            rows.append(('/odom', stamp, maker.pose('nav_msgs/msg/Odometry', stamp, odd)))
        if tick % 10 == 0:
            ranges = np.full(7, 2.0) if rng is None else rng.choice([0.3, 2.0, np.nan, np.inf, -1.0, 0.0, 1e30], 7)
            rows.append(('/scan', stamp, maker.scan(stamp, ranges, 'laser')))
    return rows


def odd_row(rng, row):
    """Change a message's own shape, once in a while."""
    topic, stamp, message = row
    header = getattr(message, 'header', None)
    if header is not None and header.stamp.sec >= 2**31:  # rosbags writes ROS 1's unsigned seconds as signed ones
        header.stamp.sec -= 2**32
    if topic == '/joint_states' and rng.random() < 0.02:
        message.name = list(pick(rng, ([], [JOINTS[0]], [JOINTS[0]] * 2, ['a\nb', 'ä'], [*JOINTS, 'x'])))
    elif topic == '/joint_states' and rng.random() < 0.02:
        message.position = np.array(pick(rng, ([], [1.0], [np.nan, np.inf], [1.0] * 50)))
    elif topic == '/scan' and rng.random() < 0.1:
        name = pick(rng, ('angle_min', 'angle_max', 'angle_increment', 'range_min', 'range_max'))
        setattr(message, name, float(np.float32(np.clip(odd_float(rng), -3e38, 3e38))))
    elif topic == '/scan' and rng.random() < 0.05:
        message.ranges = np.zeros(int(pick(rng, (0, 1, 5000))), np.float32)
    return topic, stamp, message


def _reencode(path, folder):
    reencode([str(path), '--ppr', '40', '1024', '--out', str(folder / 'what_if')])


def _map(path, folder):
    map_bag([str(path), '-f', str(folder / 'map')])
