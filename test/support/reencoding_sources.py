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
        self.is_ros2 = is_ros2
        self._maker = ROS2 if is_ros2 else ROS1
        self.rows = []  # topic, time [ns], message

    def make(self, kind, **fields):
        return self._maker.make(kind, **fields)

    def add(self, topic, time_ns, kind, **fields):
        self.rows.append((topic, time_ns, self.make(kind, **fields)))

    def add_stamped(self, topic, stamp_ns, kind, **fields):
        self.add(topic, stamp_ns, kind, header=self._maker.header(stamp_ns), **fields)

    def array(self, topic, time_ns, kind, numbers):
        layout = self.make('std_msgs/msg/MultiArrayLayout', dim=[], data_offset=0)
        self.add(topic, time_ns, kind, layout=layout, data=numbers)

    def write(self, path):
        return write(path, sorted(self.rows, key=lambda row: row[1]))


def instants(late_ns=0, speeds_radps=(4.0, 4.4), phases_rad=(0.3, 1.1)):
    """Stamp [ns] and both wheel angles of a bend at 100 Hz."""
    phases = [phase + late_ns * 1e-9 * speed for phase, speed in zip(phases_rad, speeds_radps)]
    angles = angles_rad(COUNT, speeds_radps, phases)
    return [(START_NS + late_ns + tick * TICK_NS, left, right) for tick, (left, right) in enumerate(angles.tolist())]


def two_topics(ppr, kind='std_msgs/msg/Int16', bits=16, late_ns=0):
    """/lwheel and /rwheel of differential_drive; the right one `late_ns` after the left one."""
    bag = Bag()
    wrap = (lambda count: wrap_count(int(count), 2**bits)) if bits else int
    for stamp_ns, left, _ in instants():
        bag.add('/lwheel', stamp_ns, kind, data=wrap(ticks(left, ppr)))
    for stamp_ns, _, right in instants(late_ns):
        bag.add('/rwheel', stamp_ns, kind, data=wrap(ticks(right, ppr)))
    return bag


def kobuki(is_ros2=False):
    """Sixteen bits that wrap on the way."""
    bag, kind = Bag(is_ros2), 'kobuki_msgs/msg/SensorState'
    for stamp_ns, *angles in instants(phases_rad=(158.0, 159.0)):
        left, right = (int(ticks(angle, 2578.33, 16)) for angle in angles)
        bag.add_stamped(
            '/mobile_base/sensors/core', stamp_ns, kind, left_encoder=left, right_encoder=right, time_stamp=0
        )
    return bag


def turtlebot3(is_ros2=False):
    bag, kind = Bag(is_ros2), 'turtlebot3_msgs/msg/SensorState'
    for stamp_ns, *angles in instants():
        left, right = (int(ticks(angle, 4096)) for angle in angles)
        bag.add_stamped('/sensor_state', stamp_ns, kind, left_encoder=left, right_encoder=right, bumper=0)
    return bag


def jackal(is_ros2=False):
    """The wheels' travel [rad] and speed [rad/s]."""
    bag, kind = Bag(is_ros2), 'jackal_msgs/msg/DriveFeedback'
    for stamp_ns, *angles in instants():
        drives = [
            bag.make(kind, current=0.0, measured_velocity=speed, measured_travel=angle)
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


def create3():
    bag, kind = Bag(is_ros2=True), 'irobot_create_msgs/msg/WheelTicks'
    for stamp_ns, *angles in instants():
        left, right = (int(ticks(angle, 508.8)) for angle in angles)
        bag.add_stamped('/wheel_ticks', stamp_ns, kind, ticks_left=left, ticks_right=right)
    return bag


def arrays(kind='std_msgs/msg/Int32MultiArray', dtype=np.int32, is_ros2=False):
    bag = Bag(is_ros2)
    for stamp_ns, *angles in instants():
        bag.array('/encoders', stamp_ns, kind, ticks(angles, 1000).astype(dtype))
    return bag


def odometry(is_ros2=False):
    """/odom at 100 Hz, exact."""
    bag, maker = Bag(is_ros2), ROS2 if is_ros2 else ROS1
    for tick, pose in enumerate(true_poses(angles_rad(COUNT))):
        stamp_ns = START_NS + tick * TICK_NS
        bag.rows.append(('/odom', stamp_ns, maker.pose('nav_msgs/msg/Odometry', stamp_ns, pose)))
    return bag
