"""The true poses of all models: Gazebo's ModelStates."""

from __future__ import annotations

import struct
from typing import List

import numpy as np

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import quat_xyzw_from_yaw
from diff_encoder_sim.drives.field_reader import TORN, FieldReader
from diff_encoder_sim.drives.primitives import (
    LENGTH,
    POSE,
    TWIST,
    encode_names,
    encode_pose,
    encode_sequence,
    encode_twist,
)
from diff_encoder_sim.simulation.state import BodyState
from diff_encoder_sim.simulation.world import World


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
