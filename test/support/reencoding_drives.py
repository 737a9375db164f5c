"""Recorded drives for the tests of reencoding, in bags of every kind; runs of reencode, and what they wrote."""

import csv
import struct

import numpy as np
import pytest
from rosbags import rosbag2
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from diff_encoder_sim.base.se2 import IDENTITY, move_along_arc, quat_xyzw_from_yaw
from diff_encoder_sim.cli import reencode
from diff_encoder_sim.drives.topics import ENCODER_PULSE_TYPE
from diff_encoder_sim.drives.typestore import fields_text
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder

JOINTS = ('left_wheel_joint', 'right_wheel_joint')
WHEEL_DIAMETER_M, WHEEL_SEPARATION_M = 0.2, 0.4
TICK_NS, START_NS = 10_000_000, 5_000_000_000
POSE = 'geometry_msgs/msg/PoseStamped'
COMPRESSIONS = (None, Writer1.CompressionFormat.BZ2, Writer1.CompressionFormat.LZ4)

# Next to those of ROS, types of robots in public bags.
DEFINITIONS = {
    ENCODER_PULSE_TYPE: fields_text(ENCODER_PULSE_TYPE),
    'kobuki_msgs/msg/SensorState': 'Header header\nuint16 time_stamp\nuint16 left_encoder\nuint16 right_encoder',
    'turtlebot3_msgs/msg/SensorState': 'Header header\nuint8 bumper\nint32 left_encoder\nint32 right_encoder',
    'jackal_msgs/msg/DriveFeedback': 'float32 current\nfloat32 measured_velocity\nfloat32 measured_travel',
    'jackal_msgs/msg/Feedback': 'Header header\njackal_msgs/DriveFeedback[2] drivers\nfloat32 pcb_temperature',
    'duckietown_msgs/msg/WheelEncoderStamped': 'Header header\nint32 data\nuint16 resolution',
    'irobot_create_msgs/msg/WheelTicks': 'Header header\nint32 ticks_left\nint32 ticks_right',
    'tf2_msgs/msg/TFMessage': 'geometry_msgs/TransformStamped[] transforms',
}


class Maker:
    """Messages of ROS 1 or ROS 2."""

    def __init__(self, is_ros2):
        self.is_ros2 = is_ros2
        self.store = get_typestore(Stores.ROS2_HUMBLE if is_ros2 else Stores.ROS1_NOETIC)
        for kind, text in DEFINITIONS.items():
            if kind not in self.store.types:
                spelled = text.replace('Header header', 'std_msgs/Header header')
                self.store.register(get_types_from_msg(spelled, kind))

    def make(self, kind, **fields):
        return self.store.types[kind](**fields)

    def header(self, stamp_ns, frame=''):
        time = self.make('builtin_interfaces/msg/Time', sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
        seq = {} if self.is_ros2 else {'seq': 0}
        return self.make('std_msgs/msg/Header', stamp=time, frame_id=frame, **seq)

    def joint_state(self, stamp_ns, angles_rad, names=JOINTS):
        arrays = dict(position=np.array(angles_rad, float), velocity=np.zeros(len(angles_rad)), effort=np.zeros(0))
        fields = dict(name=list(names), **arrays)
        return self.make('sensor_msgs/msg/JointState', header=self.header(stamp_ns), **fields)

    def scan(self, stamp_ns, ranges_m, frame):
        numbers = dict(angle_min=-1.5, angle_max=1.5, angle_increment=0.5, time_increment=0.0, scan_time=0.125)
        arrays = dict(ranges=np.array(ranges_m, np.float32), intensities=np.zeros(0, np.float32))
        about = dict(header=self.header(stamp_ns, frame), range_min=0.25, range_max=6.0)
        return self.make('sensor_msgs/msg/LaserScan', **numbers, **arrays, **about)

    def pulses(self, stamp_ns, counts, names=JOINTS):
        fields = dict(name=list(names), pulses=np.array(counts, np.int64))
        return self.make(ENCODER_PULSE_TYPE, header=self.header(stamp_ns), **fields)

    def _xyz(self, kind, x=0.0, y=0.0, z=0.0):
        return self.make('geometry_msgs/msg/' + kind, x=x, y=y, z=z)

    def _quat(self, pose):
        return self.make('geometry_msgs/msg/Quaternion', **dict(zip('xyzw', quat_xyzw_from_yaw(pose.yaw_rad))))

    def transform(self, stamp_ns, pose, parent, child):
        moved = dict(translation=self._xyz('Vector3', pose.x_m, pose.y_m), rotation=self._quat(pose))
        fields = dict(child_frame_id=child, transform=self.make('geometry_msgs/msg/Transform', **moved))
        return self.make('geometry_msgs/msg/TransformStamped', header=self.header(stamp_ns, parent), **fields)

    def tf(self, *transforms):
        return self.make('tf2_msgs/msg/TFMessage', transforms=list(transforms))

    def pose(self, kind, stamp_ns, pose):
        """Return a message of one of the types with a pose."""
        if kind.endswith('TransformStamped'):
            return self.transform(stamp_ns, pose, 'map', 'robot')
        place = dict(position=self._xyz('Point', pose.x_m, pose.y_m), orientation=self._quat(pose))
        made, moving = self.make('geometry_msgs/msg/Pose', **place), {}
        if not kind.endswith('PoseStamped'):
            made = self._uncertain('Pose', pose=made)
        if kind.endswith('Odometry'):
            moving = dict(child_frame_id='base_link', twist=self._uncertain('Twist', twist=self.command(0.0, 0.0)))
        return self.make(kind, header=self.header(stamp_ns, 'map'), pose=made, **moving)

    def _uncertain(self, kind, **part):
        return self.make(f'geometry_msgs/msg/{kind}WithCovariance', covariance=np.zeros(36), **part)

    def command(self, linear_mps, angular_radps):
        vectors = dict(linear=self._xyz('Vector3', x=linear_mps), angular=self._xyz('Vector3', z=angular_radps))
        return self.make('geometry_msgs/msg/Twist', **vectors)

    def text(self, text):
        return self.make('std_msgs/msg/String', data=text)

    def raw(self, message):
        serialize = self.store.serialize_cdr if self.is_ros2 else self.store.serialize_ros1
        return bytes(serialize(message, message.__msgtype__))


ROS1, ROS2 = Maker(False), Maker(True)
MAKERS = pytest.mark.parametrize('maker', [ROS1, ROS2], ids=['ROS 1', 'ROS 2'])


def angles_rad(count, speeds_radps=(4.0, 4.4), phases_rad=(0.3, 1.1)):
    """(count, 2) at 100 Hz."""
    return np.array(phases_rad) + np.outer(np.arange(count) * 0.01, speeds_radps)


def true_poses(angles):
    """Return the poses of the base, from zero, without an encoder's rounding."""
    poses = [IDENTITY]
    for left, right in np.diff(angles, axis=0) * 0.5 * WHEEL_DIAMETER_M:
        poses.append(move_along_arc(poses[-1], 0.5 * (left + right), (right - left) / WHEEL_SEPARATION_M))
    return poses


def drive(maker=ROS1, count=501, joint_topic='/joint_states', reference='/world_pose', kind=POSE, names=JOINTS):
    """[(topic, time [ns], message)] of a bend, with the truth at 20 Hz."""
    angles, rows = angles_rad(count), []
    for tick, (angle, pose) in enumerate(zip(angles, true_poses(angles))):
        now_ns = START_NS + tick * TICK_NS
        rows.append((joint_topic, now_ns, maker.joint_state(now_ns, angle, names)))
        if reference and tick % 5 == 0:
            rows.append((reference, now_ns, maker.pose(kind, now_ns, pose)))
    return rows


def write(path, rows):
    """Write messages of ROS 1 or ROS 2 into a bag."""
    kind, message = rows[0][2].__msgtype__, rows[0][2]
    return write_ros1(path, rows) if isinstance(message, ROS1.store.types[kind]) else write_ros2(path, rows)


def write_ros1(path, rows, compression=None, chunk_bytes=20_000):
    writer = Writer1(path)
    writer.chunk_threshold = chunk_bytes
    if compression:
        writer.set_compression(compression)
    return _write(writer, path, rows, ROS1)


def write_ros2(path, rows, plugin='sqlite3', compression='NONE'):
    try:
        from rosbags.rosbag2 import StoragePlugin

        options = {'version': 8, 'storage_plugin': StoragePlugin[plugin.upper()]}
    except ImportError:  # rosbags for Python 3.8 reads both, and writes only sqlite3
        if plugin != 'sqlite3':
            pytest.skip('this rosbags cannot write ' + plugin)
        options = {}
    writer = Writer2(path, **options)
    names = Writer2 if hasattr(Writer2, 'CompressionMode') else rosbag2  # of the class in rosbags for Python 3.8
    writer.set_compression(names.CompressionMode[compression], names.CompressionFormat.ZSTD)
    return _write(writer, path, rows, ROS2)


def _write(writer, path, rows, maker):
    with writer:
        connections = {}
        for topic, time_ns, message in rows:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, message.__msgtype__, typestore=maker.store)
            writer.write(connections[topic], time_ns, maker.raw(message))
    return path


def without_index(content):
    """As a recorder leaves a bag when it is killed: index_pos is 0, and the index is missing."""
    begin = content.index(b'index_pos=') + len(b'index_pos=')
    index_at = int.from_bytes(content[begin : begin + 8], 'little')
    return content[:begin] + bytes(8) + content[begin + 8 : index_at]


def run(*arguments):
    reencode.main([str(argument) for argument in arguments])


def complaint(capsys, *arguments):
    """The one line of a run that fails."""
    with pytest.raises(SystemExit) as error:
        run(*arguments)
    text = str(error.value)
    assert text.startswith('reencode: ') and '\n' not in text
    return text


def contents(path):
    """Raw messages by topic, without the seq of their headers."""
    found = {}
    with AnyReader([path]) as reader:
        for connection, _, raw in reader.messages():
            found.setdefault(connection.topic, []).append(bytes(raw)[4:])
    return found


def counts_of(path):
    """Left and right counts of a bag's /encoder_pulse."""
    return [list(struct.unpack('<qq', raw[-16:])) for raw in contents(path)['/encoder_pulse']]


def rows_of(folder):
    with open(folder / 'reencode.csv', newline='') as file:
        return list(csv.DictReader(file))


def samples_of(angles, ppr):
    """Reports of a live encoder over a drive at 100 Hz."""
    encoder = ReportingEncoder(EncoderParams(ppr=ppr))
    updates = (encoder.update(START_NS + tick * TICK_NS, JOINTS, pair) for tick, pair in enumerate(angles.tolist()))
    return [sample for samples in updates for sample in samples]
