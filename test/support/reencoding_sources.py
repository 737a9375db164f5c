"""Drives as public bags contain them: ticks, travel or speeds of the wheels in messages of many types."""

import math

import numpy as np

from diff_encoder_sim.wheels.counter import wrap_count
from reencoding_drives import ROS1, ROS2, START_NS, TICK_NS, angles_rad, true_poses, write

COUNT = 501


def ticks(angles, ppr, bits=None):
    """Equation (1), as an unsigned counter of this width shows it."""
    counts = np.floor(np.asarray(angles) * ppr / (2.0 * math.pi)).astype(np.int64)
    return counts if bits is None else counts % 2**bits


class Bag:
    """Rows of a bag, in messages of ROS 1 or ROS 2."""

    def __init__(self, is_ros2=False):
        self.maker = ROS2 if is_ros2 else ROS1
        self.rows = []  # topic, time [ns], message

    def add(self, topic, time_ns, kind, **fields):
        self.rows.append((topic, time_ns, self.maker.make(kind, **fields)))

    def add_stamped(self, topic, stamp_ns, kind, **fields):
        self.add(topic, stamp_ns, kind, header=self.maker.header(stamp_ns), **fields)

    def array(self, topic, time_ns, kind, numbers):
        layout = self.maker.make('std_msgs/msg/MultiArrayLayout', dim=[], data_offset=0)
        self.add(topic, time_ns, kind, layout=layout, data=numbers)

    def write(self, path):
        return write(path, sorted(self.rows, key=lambda row: row[1]))


def instants(phases_rad=(0.3, 1.1)):
    """Stamp [ns] and both wheel angles of a bend at 100 Hz."""
    angles = angles_rad(COUNT, phases_rad=phases_rad)
    return [(START_NS + tick * TICK_NS, left, right) for tick, (left, right) in enumerate(angles.tolist())]


def two_topics(ppr, kind='std_msgs/msg/Int16', modulus=2**16):
    """/lwheel and /rwheel of differential_drive."""
    bag = Bag()
    for stamp_ns, *angles in instants():
        for topic, count in zip(('/lwheel', '/rwheel'), ticks(angles, ppr).tolist()):
            bag.add(topic, stamp_ns, kind, data=wrap_count(count, modulus))
    return bag


def _in_one_message(topic, kind, fields, ppr, is_ros2, bits=None, phases_rad=(0.3, 1.1), **others):
    bag = Bag(is_ros2)
    for stamp_ns, *angles in instants(phases_rad):
        bag.add_stamped(topic, stamp_ns, kind, **dict(zip(fields, ticks(angles, ppr, bits).tolist())), **others)
    return bag


def kobuki(is_ros2=False):
    """Sixteen bits that wrap on the way."""
    about = dict(bits=16, phases_rad=(158.0, 159.0), time_stamp=0)
    topic, kind = '/mobile_base/sensors/core', 'kobuki_msgs/msg/SensorState'
    return _in_one_message(topic, kind, ('left_encoder', 'right_encoder'), 2578.33, is_ros2, **about)


def turtlebot3(is_ros2=False):
    kind, fields = 'turtlebot3_msgs/msg/SensorState', ('left_encoder', 'right_encoder')
    return _in_one_message('/sensor_state', kind, fields, 4096, is_ros2, bumper=0)


def create3():
    fields = 'ticks_left', 'ticks_right'
    return _in_one_message('/wheel_ticks', 'irobot_create_msgs/msg/WheelTicks', fields, 508.8, is_ros2=True)


def jackal(is_ros2=False):
    """The wheels' travel [rad] and speed [rad/s]."""
    bag = Bag(is_ros2)
    for stamp_ns, *angles in instants():
        drives = [
            bag.maker.make('jackal_msgs/msg/DriveFeedback', current=0.0, measured_velocity=speed, measured_travel=angle)
            for angle, speed in zip(angles, (4.0, 4.4))
        ]
        bag.add_stamped('/feedback', stamp_ns, 'jackal_msgs/msg/Feedback', drivers=drives, pcb_temperature=1.0)
    return bag


def duckietown():
    bag, kind = Bag(), 'duckietown_msgs/msg/WheelEncoderStamped'
    for stamp_ns, *angles in instants():
        for side, angle in zip(('left', 'right'), angles):
            topic = f'/duck/{side}_wheel_encoder_node/tick'
            bag.add_stamped(topic, stamp_ns, kind, data=int(ticks(angle, 135)), resolution=135)
    return bag


def arrays(kind='Int32', dtype=np.int32, is_ros2=False):
    bag = Bag(is_ros2)
    for stamp_ns, *angles in instants():
        bag.array('/encoders', stamp_ns, f'std_msgs/msg/{kind}MultiArray', ticks(angles, 1000).astype(dtype))
    return bag


def odometry(is_ros2=False):
    """/odom at 100 Hz, exact."""
    bag = Bag(is_ros2)
    for tick, pose in enumerate(true_poses(angles_rad(COUNT))):
        stamp_ns = START_NS + tick * TICK_NS
        bag.rows.append(('/odom', stamp_ns, bag.maker.pose('nav_msgs/msg/Odometry', stamp_ns, pose)))
    return bag
