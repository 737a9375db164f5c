"""Encodes ROS 1 messages; the seq of a leading header is 0 until `with_seq` sets it."""

from __future__ import annotations

import struct
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple, Sequence, Tuple

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D, quat_xyzw_from_yaw
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.wheels.odometry import OdometryEstimate
from diff_encoder_sim.wheels.report_link import EncoderSample

if TYPE_CHECKING:  # nodes of an encoder import this module
    from diff_encoder_sim.base.imu import ImuParams, ImuSample
    from diff_encoder_sim.base.laser_scan import Scan
    from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid
    from diff_encoder_sim.navigation.navigator_inputs import GoalStatus
    from diff_encoder_sim.simulation.state import BodyState, JointStates
    from diff_encoder_sim.simulation.world import World

UINT32 = struct.Struct('<I')
LENGTH = UINT32  # of a text or a sequence
TIME = struct.Struct('<2I')  # seconds, nanoseconds
_SEQ_AND_STAMP = struct.Struct('<3I')
POSE = struct.Struct('<7d')  # position or translation x, y, z; quaternion x, y, z, w
TWIST = struct.Struct('<6d')  # linear x, y, z; angular x, y, z
SCAN_LIMITS = struct.Struct('<7f')  # angle min, max and increment, time_increment, scan_time, range min and max
FLOAT32 = np.dtype('<f4')

Vector = Tuple[float, float, float]
QuatXyzw = Tuple[float, float, float, float]


def encode_time(stamp_ns: int) -> bytes:
    """Encode a time."""
    return TIME.pack(*divmod(stamp_ns, NANOSECONDS_PER_SECOND))


encode_clock = encode_time  # rosgraph_msgs/Clock


def encode_header(stamp_ns: int, frame: str) -> bytes:
    """Encode std_msgs/Header with seq 0."""
    return _SEQ_AND_STAMP.pack(0, *divmod(stamp_ns, NANOSECONDS_PER_SECOND)) + encode_name(frame)


def with_seq(message: bytes, seq: int) -> bytes:
    """Set the seq of a message that begins with a header."""
    return UINT32.pack(seq) + message[UINT32.size :]


def encode_text(text: str) -> bytes:
    """Encode a string."""
    content = text.encode('utf-8')
    return LENGTH.pack(len(content)) + content


encode_string = encode_text  # std_msgs/String
encode_name = lru_cache(maxsize=64)(encode_text)  # frames and joints are few, and in every message


@lru_cache(maxsize=16)
def encode_names(names: Tuple[str, ...]) -> bytes:
    """Encode string[]."""
    return encode_sequence([encode_text(name) for name in names])


def encode_sequence(elements: Sequence[bytes]) -> bytes:
    """Encode a sequence of encoded elements."""
    return LENGTH.pack(len(elements)) + b''.join(elements)


def encode_numbers(kind: str, numbers: Sequence[float]) -> bytes:
    """Encode a few numbers: float64[] of kind 'd', int64[] of 'q'."""
    return struct.pack(f'<I{len(numbers)}{kind}', len(numbers), *numbers)


def encode_array(numbers: np.ndarray, dtype: str) -> bytes:
    """Encode many numbers, row by row: float32[] of dtype '<f4', int8[] of 'i1'."""
    return LENGTH.pack(numbers.size) + numbers.astype(dtype).tobytes()


def encode_pose(position_xyz_m: Vector, quat_xyzw: QuatXyzw) -> bytes:
    """Encode geometry_msgs/Pose or Transform."""
    return POSE.pack(*position_xyz_m, *quat_xyzw)


def encode_planar_pose(pose: Pose2D) -> bytes:
    """Encode geometry_msgs/Pose or Transform of a planar pose."""
    return encode_pose((pose.x_m, pose.y_m, 0.0), quat_xyzw_from_yaw(pose.yaw_rad))


def encode_pose_stamped(pose: Pose2D, stamp_ns: int, frame: str) -> bytes:
    """Encode geometry_msgs/PoseStamped of a planar pose."""
    return encode_header(stamp_ns, frame) + encode_planar_pose(pose)


# The variance of height, roll and pitch, which wheels do not measure; the value is that of gazebo_ros_diff_drive.
UNKNOWN_VARIANCE = 1e12
_UNKNOWN_ROWS = np.diag(np.full(6, UNKNOWN_VARIANCE)).astype('<f8')
_Z_ROLL_PITCH, _ALL_BUT_X_AND_YAW = _UNKNOWN_ROWS[2:5].tobytes(), _UNKNOWN_ROWS[1:5].tobytes()
_ZEROS = bytes(len(_Z_ROLL_PITCH))
# Rows with numbers in some columns, zeros in the others; between them the rows of the axes that are not measured.
_PLANAR = struct.Struct('<2d24xd 2d24xd 144s 2d24xd')
_TWIST = struct.Struct('<d32xd 192s d32xd')


def encode_pose_with_covariance(pose: Pose2D, covariance: np.ndarray, stamp_ns: int, frame: str) -> bytes:
    """Encode geometry_msgs/PoseWithCovarianceStamped; `covariance` is 3x3 over (x, y, yaw), the rest 0 as in amcl."""
    x, y, yaw = covariance.tolist()
    return encode_pose_stamped(pose, stamp_ns, frame) + _PLANAR.pack(*x, *y, _ZEROS, *yaw)


def encode_pose_array(poses: np.ndarray, stamp_ns: int, frame: str) -> bytes:
    """Encode geometry_msgs/PoseArray of planar poses, (n, 3): x [m], y [m], yaw [rad]."""
    half_yaws_rad = 0.5 * poses[:, 2]
    zeros = np.zeros_like(half_yaws_rad)
    spatial = (poses[:, 0], poses[:, 1], zeros, zeros, zeros, np.sin(half_yaws_rad), np.cos(half_yaws_rad))
    return encode_header(stamp_ns, frame) + LENGTH.pack(len(poses)) + np.stack(spatial, 1).astype('<f8').tobytes()


def encode_transform(child_pose: Pose2D, stamp_ns: int, parent_frame: str, child_frame: str) -> bytes:
    """Encode geometry_msgs/TransformStamped of a frame's planar pose in its parent."""
    return encode_header(stamp_ns, parent_frame) + encode_name(child_frame) + encode_planar_pose(child_pose)


def encode_spatial_transform(
    translation_xyz_m: Vector, quat_xyzw: QuatXyzw, stamp_ns: int, parent_frame: str, child_frame: str
) -> bytes:
    """Encode geometry_msgs/TransformStamped of a frame's pose in its parent."""
    return encode_header(stamp_ns, parent_frame) + encode_name(child_frame) + encode_pose(translation_xyz_m, quat_xyzw)


def encode_tf(*transforms: bytes) -> bytes:
    """Encode tf2_msgs/TFMessage of encoded transforms."""
    return encode_sequence(transforms)


def encode_planar_tf(child_pose: Pose2D, stamp_ns: int, parent_frame: str, child_frame: str) -> bytes:
    """Encode tf2_msgs/TFMessage of one frame's planar pose in its parent."""
    return encode_tf(encode_transform(child_pose, stamp_ns, parent_frame, child_frame))


def encode_twist(linear_xyz_mps: Vector, angular_xyz_radps: Vector) -> bytes:
    """Encode geometry_msgs/Twist."""
    return TWIST.pack(*linear_xyz_mps, *angular_xyz_radps)


def encode_command(linear_mps: float, angular_radps: float) -> bytes:
    """Encode geometry_msgs/Twist of a velocity command."""
    return encode_twist((linear_mps, 0.0, 0.0), (0.0, 0.0, angular_radps))


def encode_odometry(estimate: OdometryEstimate, odom_frame: str, base_frame: str) -> bytes:
    """Encode nav_msgs/Odometry: pose in the odom frame, twist in the base frame, with covariances."""
    linear_mps = (estimate.linear_velocity_mps, estimate.lateral_velocity_mps, 0.0)
    xx, xy, x_yaw, yy, y_yaw, yaw_yaw = estimate.of_pose
    of_linear, together, of_angular = estimate.of_twist
    parts = (
        encode_header(estimate.stamp_ns, odom_frame),
        encode_name(base_frame),
        encode_planar_pose(estimate.base_pose_in_odom),
        _PLANAR.pack(xx, xy, x_yaw, xy, yy, y_yaw, _Z_ROLL_PITCH, x_yaw, y_yaw, yaw_yaw),
        encode_twist(linear_mps, (0.0, 0.0, estimate.angular_velocity_radps)),
        _TWIST.pack(of_linear, together, _ALL_BUT_X_AND_YAW, together, of_angular),
    )
    return b''.join(parts)


def encode_joint_state(joints: JointStates) -> bytes:
    """Encode sensor_msgs/JointState: wheel angles and speeds; efforts are left out."""
    angles_rad, speeds_radps, names = joints.angles_rad, joints.speeds_radps, encode_names(joints.names)
    # In one piece, as it is the most frequent message except /clock. struct keeps the compiled format.
    fields = f'<4I{len(names)}sI{len(angles_rad)}dI{len(speeds_radps)}dI'
    stamp = divmod(joints.stamp_ns, NANOSECONDS_PER_SECOND)
    return struct.pack(fields, 0, *stamp, 0, names, len(angles_rad), *angles_rad, len(speeds_radps), *speeds_radps, 0)


def encode_encoder_pulse(sample: EncoderSample, joints: Tuple[str, str]) -> bytes:
    """Encode diff_encoder_sim/EncoderPulse, left then right; `joints` are their names in that order."""
    pulses = encode_numbers('q', (sample.left_pulses, sample.right_pulses))
    return encode_header(sample.stamp_ns, '') + encode_names(joints) + pulses


def encode_wheel_speeds(stamp_ns: int, speeds_radps: Tuple[float, float], joints: Tuple[str, str]) -> bytes:
    """Encode sensor_msgs/JointState with only speeds, left then right; `joints` are their names in that order."""
    positions, speeds, efforts = (encode_numbers('d', values) for values in ((), speeds_radps, ()))
    return encode_header(stamp_ns, '') + encode_names(joints) + positions + speeds + efforts


def encode_scan(scan: Scan, frame: str, period_s: float) -> bytes:
    """Encode sensor_msgs/LaserScan whose rays were all taken at its stamp, one scan each `period_s`."""
    begin_rad, increment_rad = scan.angle_min_rad, scan.angle_increment_rad
    end_rad = begin_rad + (len(scan.ranges_m) - 1) * increment_rad
    limits = SCAN_LIMITS.pack(begin_rad, end_rad, increment_rad, 0.0, period_s, scan.range_min_m, scan.range_max_m)
    ranges = encode_array(scan.ranges_m, FLOAT32.str)
    return encode_header(scan.stamp_ns, frame) + limits + ranges + encode_numbers('f', ())


def encode_map(grid: OccupancyGrid, stamp_ns: int, frame: str) -> bytes:
    """Encode nav_msgs/OccupancyGrid, row by row from the origin."""
    return encode_header(stamp_ns, frame) + encode_map_metadata(grid, stamp_ns) + encode_array(grid.cells, 'i1')


def encode_map_metadata(grid: OccupancyGrid, stamp_ns: int) -> bytes:
    """Encode nav_msgs/MapMetaData."""
    size = struct.pack('<f2I', grid.resolution_m, grid.width, grid.height)
    return encode_time(stamp_ns) + size + encode_planar_pose(grid.origin)


_ACTION_STATUS = {'PREEMPTED': 2, 'SUCCEEDED': 3, 'ABORTED': 4}  # actionlib_msgs/GoalStatus of a goal that is over


class SentGoal(NamedTuple):
    """Identity of a goal of an action: actionlib_msgs/GoalID."""

    node: str  # that sent it
    number: int  # of its goals, from 1
    stamp_ns: int  # when it was sent

    def encoded(self) -> bytes:
        """Encode it as actionlib's Python client makes it."""
        stamp_s = self.stamp_ns / NANOSECONDS_PER_SECOND
        return encode_time(self.stamp_ns) + encode_text(f'{self.node}-{self.number}-{stamp_s:.3f}')


def encode_goal(sent: SentGoal, goal_in_map: Pose2D, goal_stamp_ns: int, frame: str) -> bytes:
    """Encode move_base_msgs/MoveBaseActionGoal; `goal_stamp_ns` is of the pose, not of the sending."""
    return encode_header(sent.stamp_ns, '') + sent.encoded() + encode_pose_stamped(goal_in_map, goal_stamp_ns, frame)


def encode_result(sent: SentGoal, status: GoalStatus, text: str, stamp_ns: int) -> bytes:
    """Encode move_base_msgs/MoveBaseActionResult of a goal that is over; MoveBaseResult has no fields."""
    return encode_header(stamp_ns, '') + sent.encoded() + bytes([_ACTION_STATUS[status.name]]) + encode_text(text)


class ImuEncoder:
    """Encodes sensor_msgs/Imu (REP-145): no orientation; variances of white noise and quantisation."""

    def __init__(self, params: ImuParams) -> None:
        # A covariance that begins with -1 marks the orientation as not measured.
        self._before = encode_name(params.frame) + struct.pack('<13d', 0.0, 0.0, 0.0, 1.0, -1.0, *[0.0] * 8)
        self._covariances = [
            np.diag([sensor.noise_variance(params.rate)] * 3).astype('<f8').tobytes()
            for sensor in (params.gyroscope, params.accelerometer)
        ]
        self._fields = struct.Struct(f'<3I{len(self._before)}s3d72s3d72s')

    def encode(self, sample: ImuSample) -> bytes:
        """Encode a message; angular velocity and specific force are in the IMU's frame."""
        stamp, (of_angular, of_linear) = divmod(sample.stamp_ns, NANOSECONDS_PER_SECOND), self._covariances
        measured = *sample.angular_velocity_radps, of_angular, *sample.linear_acceleration_mps2, of_linear
        return self._fields.pack(0, *stamp, self._before, *measured)


class ModelStatesEncoder:
    """Encodes gazebo_msgs/ModelStates of a world in which only the robot moves; it is the last model."""

    def __init__(self, world: World, robot_name: str) -> None:
        self._names = encode_names((*(model.name for model in world.models), robot_name))
        self._poses = []
        for model in world.models:
            (x_m, y_m, z_m), pose = model.pose_in_world[:3, 3].tolist(), model.pose_in_world
            quat_xyzw = quat_xyzw_from_yaw(float(np.arctan2(pose[1, 0], pose[0, 0])))  # models stand on the floor
            self._poses.append(encode_pose((x_m, y_m, z_m), quat_xyzw))
        self._twists = [encode_twist((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))] * len(self._poses)

    def encode(self, robot: BodyState) -> bytes:
        """Encode a message with the robot's pose and twist in the world frame."""
        pose = encode_pose(robot.position_xyz_m, robot.quat_xyzw)
        twist = encode_twist(robot.linear_xyz_mps, robot.angular_xyz_radps)
        return self._names + encode_sequence([*self._poses, pose]) + encode_sequence([*self._twists, twist])
