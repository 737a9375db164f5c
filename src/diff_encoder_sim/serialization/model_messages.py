"""The true poses of all models: Gazebo's ModelStates."""

from __future__ import annotations

import numpy as np

from diff_encoder_sim.base.se2 import quat_xyzw_from_yaw
from diff_encoder_sim.serialization.primitives import encode_names, encode_pose, encode_sequence, encode_twist
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


def _encode_upright_pose(pose: np.ndarray) -> bytes:
    """Encode a 4x4 pose of a model that stands on the floor."""
    x_m, y_m, z_m = pose[:3, 3].tolist()
    yaw_rad = float(np.arctan2(pose[1, 0], pose[0, 0]))
    return encode_pose((x_m, y_m, z_m), quat_xyzw_from_yaw(yaw_rad))
