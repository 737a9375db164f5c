"""Recorded drives for the tests of reencoding, in bags of every kind."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from rosbags import rosbag2
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from diff_encoder_sim.base.se2 import IDENTITY, move_along_arc, quat_xyzw_from_yaw
from diff_encoder_sim.drives.topics import ENCODER_PULSE_TYPE
from diff_encoder_sim.drives.typestore import fields_text, noetic_store

JOINTS = ('left_wheel_joint', 'right_wheel_joint')
WHEEL_DIAMETER_M, WHEEL_SEPARATION_M = 0.2, 0.4
TICK_NS, START_NS = 10_000_000, 5_000_000_000
COMPRESSIONS = (None, Writer1.CompressionFormat.BZ2, Writer1.CompressionFormat.LZ4)

STORE2 = get_typestore(Stores.ROS2_HUMBLE)
STORE2.register(
    get_types_from_msg(fields_text(ENCODER_PULSE_TYPE).replace('\nHeader ', '\nstd_msgs/Header '), ENCODER_PULSE_TYPE)
)


class Maker:
    """Messages of ROS 1 or ROS 2."""

    def __init__(self, store):
        self.store = store
        self.is_ros2 = store is STORE2

    def make(self, kind, **fields):
        return self.store.types[kind](**fields)

    def header(self, stamp_ns, frame=''):
        time = self.make('builtin_interfaces/msg/Time', sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
        seq = {} if self.is_ros2 else {'seq': 0}
        return self.make('std_msgs/msg/Header', stamp=time, frame_id=frame, **seq)

    def joint_state(self, stamp_ns, angles_rad, names=JOINTS):
        return self.make(
            'sensor_msgs/msg/JointState',
            header=self.header(stamp_ns),
            name=list(names),
            position=np.array(angles_rad, float),
            velocity=np.zeros(len(angles_rad)),
            effort=np.zeros(0),
        )

    def scan(self, stamp_ns, ranges_m, frame):
        numbers = dict(angle_min=-1.5, angle_max=1.5, angle_increment=0.5, time_increment=0.0, scan_time=0.125)
        return self.make(
            'sensor_msgs/msg/LaserScan',
            header=self.header(stamp_ns, frame),
            **numbers,
            range_min=0.25,
            range_max=6.0,
            ranges=np.array(ranges_m, np.float32),
            intensities=np.zeros(0, np.float32),
        )

    def pulses(self, stamp_ns, counts, names=JOINTS):
        return self.make(
            'diff_encoder_sim/msg/EncoderPulse',
            header=self.header(stamp_ns),
            name=list(names),
            pulses=np.array(counts, np.int64),
        )

    def _xyz(self, kind, pose):
        return self.make('geometry_msgs/msg/' + kind, x=pose.x_m, y=pose.y_m, z=0.0)

    def _quat(self, pose):
        return self.make('geometry_msgs/msg/Quaternion', **dict(zip('xyzw', quat_xyzw_from_yaw(pose.yaw_rad))))

    def _pose(self, pose):
        return self.make('geometry_msgs/msg/Pose', position=self._xyz('Point', pose), orientation=self._quat(pose))

    def _with_covariance(self, pose):
        return self.make('geometry_msgs/msg/PoseWithCovariance', pose=self._pose(pose), covariance=np.zeros(36))

    def transform(self, stamp_ns, pose, parent, child):
        return self.make(
            'geometry_msgs/msg/TransformStamped',
            header=self.header(stamp_ns, parent),
            child_frame_id=child,
            transform=self.make(
                'geometry_msgs/msg/Transform', translation=self._xyz('Vector3', pose), rotation=self._quat(pose)
            ),
        )

    def tf(self, *transforms):
        return self.make('tf2_msgs/msg/TFMessage', transforms=list(transforms))

    def pose(self, kind, stamp_ns, pose):
        """Return a message of one of the types with a pose."""
        header = self.header(stamp_ns, 'map')
        if kind.endswith('TransformStamped'):
            return self.transform(stamp_ns, pose, 'map', 'robot')
        if kind.endswith('PoseStamped'):
            return self.make(kind, header=header, pose=self._pose(pose))
        if kind.endswith('PoseWithCovarianceStamped'):
            return self.make(kind, header=header, pose=self._with_covariance(pose))
        zero = self.make('geometry_msgs/msg/Vector3', x=0.0, y=0.0, z=0.0)
        twist = self.make('geometry_msgs/msg/Twist', linear=zero, angular=zero)
        return self.make(
            kind,
            header=header,
            child_frame_id='base_link',
            pose=self._with_covariance(pose),
            twist=self.make('geometry_msgs/msg/TwistWithCovariance', twist=twist, covariance=np.zeros(36)),
        )

    def command(self, linear_mps, angular_radps):
        vectors = [dict(x=linear_mps, y=0.0, z=0.0), dict(x=0.0, y=0.0, z=angular_radps)]
        linear, angular = (self.make('geometry_msgs/msg/Vector3', **vector) for vector in vectors)
        return self.make('geometry_msgs/msg/Twist', linear=linear, angular=angular)

    def text(self, text):
        return self.make('std_msgs/msg/String', data=text)

    def raw(self, message):
        kind = message.__msgtype__
        return bytes(
            self.store.serialize_cdr(message, kind) if self.is_ros2 else self.store.serialize_ros1(message, kind)
        )


ROS1, ROS2 = Maker(noetic_store()), Maker(STORE2)
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


def drive(
    maker=ROS1,
    count=501,
    joint_topic='/joint_states',
    reference='/world_pose',
    kind='geometry_msgs/msg/PoseStamped',
    names=JOINTS,
):
    """[(topic, time [ns], message)] of a bend, with the truth at 20 Hz."""
    angles = angles_rad(count)
    rows = []
    for tick, (angle, pose) in enumerate(zip(angles, true_poses(angles))):
        now_ns = START_NS + tick * TICK_NS
        rows.append((joint_topic, now_ns, maker.joint_state(now_ns, angle, names)))
        if reference and tick % 5 == 0:
            rows.append((reference, now_ns, maker.pose(kind, now_ns, pose)))
    return rows


def write_ros1(path, rows, compression=None, chunk_bytes=20_000):
    writer = Writer1(path)
    writer.chunk_threshold = chunk_bytes
    if compression:
        writer.set_compression(compression)
    _write(writer, rows, noetic_store(), noetic_store().serialize_ros1)
    return path


def write_ros2(path, rows, plugin='sqlite3', compression='NONE'):
    try:
        from rosbags.rosbag2 import StoragePlugin

        options = {'version': 8, 'storage_plugin': StoragePlugin[plugin.upper()]}
    except ImportError:  # rosbags for Python 3.8 reads both, and writes sqlite3 only
        if plugin != 'sqlite3':
            pytest.skip('this rosbags cannot write ' + plugin)
        options = {}
    writer = Writer2(path, **options)
    names = Writer2 if hasattr(Writer2, 'CompressionMode') else rosbag2  # of the class in rosbags for Python 3.8
    writer.set_compression(names.CompressionMode[compression], names.CompressionFormat.ZSTD)
    _write(writer, rows, STORE2, STORE2.serialize_cdr)
    return path


def converted_to_ros2(path, to):
    """By rosbags-convert, whose options have changed between the versions of rosbags."""
    command = str(Path(sys.executable).with_name('rosbags-convert'))
    options = subprocess.run([command, '--help'], stdout=subprocess.PIPE, text=True, check=True).stdout
    source = ['--src', str(path)] if '--src' in options else [str(path)]
    subprocess.run([command, *source, '--dst', str(to)], check=True)
    return to


def _write(writer, rows, store, serialize):
    with writer:
        connections = {}
        for topic, time_ns, message in rows:
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], time_ns, serialize(message, kind))


def without_index(content):
    """As a recorder leaves a bag when it is killed: index_pos is 0, and the index is missing."""
    begin = content.index(b'index_pos=') + len(b'index_pos=')
    index_at = int.from_bytes(content[begin : begin + 8], 'little')
    return content[:begin] + bytes(8) + content[begin + 8 : index_at]


def with_fields_in_order(content, order):
    """An uncompressed bag whose messages have their record's fields in another order."""

    def swap(match):
        fields = {'op': match[1], 'conn': match[2], 'time': match[3]}
        return b''.join(fields[name] for name in order)

    return re.sub(rb'(\x04\0\0\0op=\x02)(\x09\0\0\0conn=.{4})(\x0d\0\0\0time=.{8})', swap, content, flags=re.DOTALL)
