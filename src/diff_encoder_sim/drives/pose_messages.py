"""Stamped poses: PoseStamped, PoseWithCovarianceStamped, Odometry and TransformStamped."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Iterator, List, NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D, quat_xyzw_from_yaw, yaw_from_quat_xyzw
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.topics import (
    ODOMETRY_TYPE,
    POSE_STAMPED_TYPE,
    POSE_WITH_COVARIANCE_TYPE,
    TRANSFORM_STAMPED_TYPE,
)
from diff_encoder_sim.drives.wire import (
    FRAME_AT,
    LENGTH,
    NUMBER_SIZE,
    POSE,
    STAMP_AT,
    TIME,
    TORN,
    TWIST,
    FieldReader,
    QuatXyzw,
    Vector,
    encode_amcl_covariance,
    encode_header,
    encode_name,
    encode_names,
    encode_odometry_covariance,
    encode_pose,
    encode_sequence,
    encode_twist,
    encode_twist_covariance,
)
from diff_encoder_sim.wheels.odometry import OdometryEstimate

if TYPE_CHECKING:  # nodes of an encoder import this module
    from diff_encoder_sim.simulation.state import BodyState
    from diff_encoder_sim.simulation.world import World

POSE_TYPES = (ODOMETRY_TYPE, POSE_STAMPED_TYPE, POSE_WITH_COVARIANCE_TYPE, TRANSFORM_STAMPED_TYPE)
# Those with child_frame_id between header and pose.
_WITH_CHILD_FRAME = (ODOMETRY_TYPE, TRANSFORM_STAMPED_TYPE)
# No robot comes so far; squares of more may not be finite.
_FARTHEST_M = 1e9


class StampedPose(NamedTuple):
    """A child frame's pose in its parent frame at one instant, seen from above."""

    stamp_ns: int
    pose: Pose2D
    parent_frame: str
    child_frame: str  # empty where the message does not name it


def encode_planar_pose(pose: Pose2D) -> bytes:
    """Encode geometry_msgs/Pose or Transform of a planar pose."""
    return encode_pose((pose.x_m, pose.y_m, 0.0), quat_xyzw_from_yaw(pose.yaw_rad))


def encode_pose_stamped(pose: Pose2D, stamp_ns: int, frame: str) -> bytes:
    """Encode geometry_msgs/PoseStamped of a planar pose."""
    return encode_header(stamp_ns, frame) + encode_planar_pose(pose)


def encode_pose_with_covariance(pose: Pose2D, covariance: np.ndarray, stamp_ns: int, frame: str) -> bytes:
    """Encode geometry_msgs/PoseWithCovarianceStamped; `covariance` is 3x3 over (x, y, yaw)."""
    return encode_pose_stamped(pose, stamp_ns, frame) + encode_amcl_covariance(covariance)


def encode_pose_array(poses: np.ndarray, stamp_ns: int, frame: str) -> bytes:
    """Encode geometry_msgs/PoseArray of planar poses, (n, 3): x [m], y [m], yaw [rad]."""
    half_yaws_rad = 0.5 * poses[:, 2]
    zeros = np.zeros_like(half_yaws_rad)
    spatial = (poses[:, 0], poses[:, 1], zeros, zeros, zeros, np.sin(half_yaws_rad), np.cos(half_yaws_rad))
    return encode_header(stamp_ns, frame) + LENGTH.pack(len(poses)) + np.stack(spatial, 1).astype('<f8').tobytes()


def encode_odometry(estimate: OdometryEstimate, odom_frame: str, base_frame: str) -> bytes:
    """Encode nav_msgs/Odometry: pose in the odom frame, twist in the base frame, with covariances."""
    linear_mps = (estimate.linear_velocity_mps, estimate.lateral_velocity_mps, 0.0)
    return b''.join(
        (
            encode_header(estimate.stamp_ns, odom_frame),
            encode_name(base_frame),
            encode_planar_pose(estimate.base_pose_in_odom),
            encode_odometry_covariance(estimate.of_pose),
            encode_twist(linear_mps, (0.0, 0.0, estimate.angular_velocity_radps)),
            encode_twist_covariance(estimate.of_twist),
        )
    )


class PoseDecoder:
    """Decodes the messages of one topic, of one of `POSE_TYPES`.

    From message to message the frames stay the same, so they are compared and not decoded.
    """

    def __init__(self, message_type: str, is_cdr: bool = False) -> None:
        self._has_child = message_type in _WITH_CHILD_FRAME
        self._is_cdr = is_cdr
        self._raw_frames = b''  # from the parent frame to the pose
        self._frames = ('', '')
        self._pose_at = 0

    def decode(self, raw: bytes) -> StampedPose:
        """Decode a message.

        Raises:
            InputFault: the message is torn, or its pose is not finite.
        """
        if not self._raw_frames or not raw.startswith(self._raw_frames, FRAME_AT):
            self._learn_frames(raw)
        try:
            seconds, nanoseconds = TIME.unpack_from(raw, STAMP_AT)
            numbers = POSE.unpack_from(raw, self._pose_at)
        except struct.error:
            raise InputFault(TORN) from None
        return StampedPose(seconds * NANOSECONDS_PER_SECOND + nanoseconds, _planar_pose(*numbers), *self._frames)

    def _learn_frames(self, raw: bytes) -> None:
        fields = FieldReader(raw, self._is_cdr)
        self._frames = _read_frames(fields, self._has_child)[1:]
        self._pose_at = fields.align(NUMBER_SIZE)
        self._raw_frames = raw[FRAME_AT : self._pose_at]


def read_stamped_pose(fields: FieldReader) -> StampedPose:
    """Read a TransformStamped among other fields.

    Raises:
        InputFault: the message is torn, or its pose is not finite.
    """
    stamp_ns, parent_frame, child_frame = _read_frames(fields, has_child=True)
    return StampedPose(stamp_ns, _planar_pose(*fields.unpack(POSE, NUMBER_SIZE)), parent_frame, child_frame)


def _read_frames(fields: FieldReader, has_child: bool) -> Tuple[int, str, str]:
    stamp_ns, parent_frame = fields.header()
    child_frame = fields.text() if has_child else ''
    return stamp_ns, parent_frame.lstrip('/'), child_frame.lstrip('/')


def _planar_pose(x_m: float, y_m: float, z_m: float, qx: float, qy: float, qz: float, qw: float) -> Pose2D:
    if not abs(x_m) + abs(y_m) + abs(z_m) <= _FARTHEST_M:
        raise InputFault(f'position ({x_m}, {y_m}, {z_m}); expected finite numbers [m]')
    try:
        return Pose2D(x_m, y_m, yaw_from_quat_xyzw(qx, qy, qz, qw))
    except ValueError as error:
        raise InputFault(str(error)) from None


def encode_transform(child_pose: Pose2D, stamp_ns: int, parent_frame: str, child_frame: str) -> bytes:
    """Encode geometry_msgs/TransformStamped of a frame's planar pose in its parent."""
    return encode_header(stamp_ns, parent_frame) + encode_name(child_frame) + encode_planar_pose(child_pose)


def encode_spatial_transform(
    translation_xyz_m: Vector, quat_xyzw: QuatXyzw, stamp_ns: int, parent_frame: str, child_frame: str
) -> bytes:
    """Encode geometry_msgs/TransformStamped of a frame's pose in its parent."""
    return encode_header(stamp_ns, parent_frame) + encode_name(child_frame) + encode_pose(translation_xyz_m, quat_xyzw)


def encode_planar_tf(child_pose: Pose2D, stamp_ns: int, parent_frame: str, child_frame: str) -> bytes:
    """Encode tf2_msgs/TFMessage of one frame's planar pose in its parent."""
    return encode_tf(encode_transform(child_pose, stamp_ns, parent_frame, child_frame))


def encode_tf(*transforms: bytes) -> bytes:
    """Encode tf2_msgs/TFMessage of encoded transforms."""
    return encode_sequence(transforms)


def decode_tf(raw: bytes, is_cdr: bool = False) -> Iterator[StampedPose]:
    """Decode the poses of a TFMessage, seen from above.

    Raises:
        InputFault: the message is torn, or a pose is not finite.
    """
    fields = FieldReader(raw, is_cdr)
    for _ in range(fields.length()):
        yield read_stamped_pose(fields)


class ModelStatesEncoder:
    """Encodes gazebo_msgs/ModelStates of a world in which the robot alone moves; it comes last."""

    def __init__(self, world: World, robot_name: str) -> None:
        self._names = encode_names((*(model.name for model in world.models), robot_name))
        self._poses = [_encode_upright_pose(model.pose_in_world) for model in world.models]
        self._twists = [encode_twist((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))] * len(self._poses)

    def encode(self, robot: BodyState) -> bytes:
        """Encode a message with the robot's pose and twist in the world frame."""
        pose = encode_pose(robot.position_xyz_m, robot.quat_xyzw)
        twist = encode_twist(robot.linear_xyz_mps, robot.angular_xyz_radps)
        return self._names + encode_sequence([*self._poses, pose]) + encode_sequence([*self._twists, twist])


class ModelStateDecoder:
    """Decodes one model's state of the messages of a topic, of any simulator.

    From message to message the names stay the same, so they are compared and not decoded.
    """

    def __init__(self, model: str) -> None:
        self._model = model
        self._raw_names = b''
        self._names: List[str] = []

    def decode(self, raw: bytes) -> BodyState:
        """Decode a message.

        Raises:
            InputFault: the message is torn, or has no state of the model.
        """
        if not self._raw_names or not raw.startswith(self._raw_names):
            self._learn_names(raw)
        if self._model not in self._names:
            raise InputFault(f'no model {self._model!r}; expected it among {self._names}')
        index, poses_at = self._names.index(self._model), len(self._raw_names)
        try:
            pose_count = LENGTH.unpack_from(raw, poses_at)[0]
            twists_at = poses_at + LENGTH.size + pose_count * POSE.size
            twist_count = LENGTH.unpack_from(raw, twists_at)[0]
            if not index < min(pose_count, twist_count):
                counts = f'{len(self._names)} names, {pose_count} poses, {twist_count} twists'
                raise InputFault(f'model {self._model!r} has no state: {counts}')
            pose = POSE.unpack_from(raw, poses_at + LENGTH.size + index * POSE.size)
            twist = TWIST.unpack_from(raw, twists_at + LENGTH.size + index * TWIST.size)
        except struct.error:
            raise InputFault(TORN) from None
        from diff_encoder_sim.simulation.state import BodyState  # noqa: PLC0415  not for the nodes of the wheels

        return BodyState(pose[:3], pose[3:], twist[:3], twist[3:])

    def _learn_names(self, raw: bytes) -> None:
        fields = FieldReader(raw, is_cdr=False)
        names = [fields.text() for _ in range(fields.length())]
        self._names, self._raw_names = names, raw[: fields.align(1)]


def _encode_upright_pose(pose: np.ndarray) -> bytes:
    """Encode a 4x4 pose of a model that stands on the floor."""
    x_m, y_m, z_m = pose[:3, 3].tolist()
    yaw_rad = float(np.arctan2(pose[1, 0], pose[0, 0]))
    return encode_pose((x_m, y_m, z_m), quat_xyzw_from_yaw(yaw_rad))
