"""Drives as public bags have them: ticks, travel or speeds of the wheels in messages of many types."""

import math

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from diff_encoder_sim.wheels.counter import wrap_count
from reencoding_drives import ROS1, ROS2, START_NS, STORE2, TICK_NS, angles_rad, true_poses, write_ros2

DEFINITIONS = {
    'kobuki_msgs/msg/SensorState': 'Header header\nuint16 time_stamp\nuint16 left_encoder\nuint16 right_encoder',
    'turtlebot3_msgs/msg/SensorState': 'Header header\nuint8 bumper\nint32 left_encoder\nint32 right_encoder',
    'jackal_msgs/msg/DriveFeedback': 'float32 current\nfloat32 measured_velocity\nfloat32 measured_travel',
    'jackal_msgs/msg/Feedback': 'Header header\njackal_msgs/DriveFeedback[2] drivers\nfloat32 pcb_temperature',
    'duckietown_msgs/msg/WheelEncoderStamped': 'Header header\nint32 data\nuint16 resolution',
    'irobot_create_msgs/msg/WheelTicks': 'Header header\nint32 ticks_left\nint32 ticks_right',
}
STORE1 = get_typestore(Stores.ROS1_NOETIC)
for _name, _text in DEFINITIONS.items():
    STORE1.register(get_types_from_msg(_text, _name))
    STORE2.register(get_types_from_msg(_text.replace('Header ', 'std_msgs/Header ', 1), _name))

COUNT = 501


def ticks(angles, ppr, bits=None):
    """Equation (1), as a counter of so many bits shows it, without a sign."""
    counts = np.floor(np.asarray(angles) * ppr / (2.0 * math.pi)).astype(np.int64)
    return counts if bits is None else counts % 2**bits


class Bag:
    """Rows of a bag, in messages of ROS 1 or ROS 2."""

    def __init__(self, is_ros2=False):
        self.is_ros2 = is_ros2
        self._store = STORE2 if is_ros2 else STORE1
        self.rows = []  # topic, time [ns], message

    def make(self, kind, **fields):
        return self._store.types[kind](**fields)

    def header(self, stamp_ns):
        time = self.make('builtin_interfaces/msg/Time', sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
        return self.make('std_msgs/msg/Header', stamp=time, frame_id='', **({} if self.is_ros2 else {'seq': 0}))

    def add(self, topic, time_ns, kind, **fields):
        self.rows.append((topic, time_ns, self.make(kind, **fields)))

    def array(self, topic, time_ns, kind, numbers):
        layout = self.make('std_msgs/msg/MultiArrayLayout', dim=[], data_offset=0)
        self.add(topic, time_ns, kind, layout=layout, data=numbers)

    def write(self, path):
        rows = sorted(self.rows, key=lambda row: row[1])
        if self.is_ros2:
            return write_ros2(path, rows)
        with Writer1(path) as writer:
            connections = {}
            for topic, time_ns, message in rows:
                kind = message.__msgtype__
                if topic not in connections:
                    connections[topic] = writer.add_connection(topic, kind, typestore=STORE1)
                writer.write(connections[topic], time_ns, STORE1.serialize_ros1(message, kind))
        return path


def instants(count=COUNT, **motion):
    """Stamp [ns] and both wheel angles of a bend at 100 Hz."""
    angles = angles_rad(count, **motion)
    return [(START_NS + tick * TICK_NS, left, right) for tick, (left, right) in enumerate(angles.tolist())]


def two_topics(ppr, kind='std_msgs/msg/Int16', bits=16, late_ns=0, **motion):
    """/lwheel and /rwheel of differential_drive; the right one `late_ns` after the left one."""
    bag = Bag()
    wrap = (lambda count: wrap_count(int(count), 2**bits)) if bits else int
    for stamp_ns, left, _ in instants(**motion):
        bag.add('/lwheel', stamp_ns, kind, data=wrap(ticks(left, ppr)))
    for stamp_ns, _, right in instants_at(late_ns, **motion):
        bag.add('/rwheel', stamp_ns, kind, data=wrap(ticks(right, ppr)))
    return bag


def instants_at(late_ns, count=COUNT, speeds_radps=(4.0, 4.4), phases_rad=(0.3, 1.1)):
    """As `instants`, each `late_ns` later."""
    late_s = late_ns * 1e-9
    phases = [phase + late_s * speed for phase, speed in zip(phases_rad, speeds_radps)]
    return [
        (stamp_ns + late_ns, left, right)
        for stamp_ns, left, right in instants(count=count, speeds_radps=speeds_radps, phases_rad=phases)
    ]


def kobuki(is_ros2=False):
    """Sixteen bits that wrap on the way."""
    bag = Bag(is_ros2)
    for stamp_ns, left, right in instants(phases_rad=(158.0, 159.0)):
        left_encoder, right_encoder = (int(ticks(angle, 2578.33, 16)) for angle in (left, right))
        fields = dict(left_encoder=left_encoder, right_encoder=right_encoder, time_stamp=0)
        kind = 'kobuki_msgs/msg/SensorState'
        bag.add('/mobile_base/sensors/core', stamp_ns, kind, header=bag.header(stamp_ns), **fields)
    return bag


def turtlebot3(is_ros2=False):
    bag = Bag(is_ros2)
    for stamp_ns, left, right in instants():
        fields = dict(left_encoder=int(ticks(left, 4096)), right_encoder=int(ticks(right, 4096)), bumper=0)
        bag.add('/sensor_state', stamp_ns, 'turtlebot3_msgs/msg/SensorState', header=bag.header(stamp_ns), **fields)
    return bag


def jackal(is_ros2=False):
    """The wheels' travel [rad] and speed [rad/s]."""
    bag = Bag(is_ros2)
    for stamp_ns, *angles in instants():
        drives = [
            bag.make('jackal_msgs/msg/DriveFeedback', current=0.0, measured_velocity=speed, measured_travel=angle)
            for angle, speed in zip(angles, (4.0, 4.4))
        ]
        header = bag.header(stamp_ns)
        bag.add('/feedback', stamp_ns, 'jackal_msgs/msg/Feedback', header=header, drivers=drives, pcb_temperature=1.0)
    return bag


def duckietown():
    bag = Bag()
    for stamp_ns, *angles in instants():
        for side, angle in zip(('left', 'right'), angles):
            topic = f'/duck/{side}_wheel_encoder_node/tick'
            kind = 'duckietown_msgs/msg/WheelEncoderStamped'
            bag.add(topic, stamp_ns, kind, header=bag.header(stamp_ns), data=int(ticks(angle, 135)), resolution=135)
    return bag


def create3():
    bag = Bag(is_ros2=True)
    for stamp_ns, left, right in instants():
        fields = dict(ticks_left=int(ticks(left, 508.8)), ticks_right=int(ticks(right, 508.8)))
        bag.add('/wheel_ticks', stamp_ns, 'irobot_create_msgs/msg/WheelTicks', header=bag.header(stamp_ns), **fields)
    return bag


def arrays(kind='std_msgs/msg/Int32MultiArray', dtype=np.int32, is_ros2=False):
    bag = Bag(is_ros2)
    for stamp_ns, left, right in instants():
        bag.array('/encoders', stamp_ns, kind, np.array([ticks(left, 1000), ticks(right, 1000)], dtype))
    return bag


def odometry(is_ros2=False, poses=None):
    """/odom at 100 Hz, exact."""
    bag = Bag(is_ros2)
    poses = true_poses(angles_rad(COUNT)) if poses is None else poses
    for tick, pose in enumerate(poses):
        stamp_ns = START_NS + tick * TICK_NS
        message = (ROS2 if is_ros2 else ROS1).pose('nav_msgs/msg/Odometry', stamp_ns, pose)
        bag.rows.append(('/odom', stamp_ns, message))
    return bag
