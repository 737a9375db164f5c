"""world_pose_node: publishes the robot's true pose, from /gazebo/model_states, as /world_pose in the map frame."""

from __future__ import annotations

from geometry_msgs.msg import PoseStamped
from pydantic import Field

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.pose_messages import encode_pose_stamped
from diff_encoder_sim.drives.test_definition import PoseParams
from diff_encoder_sim.ros.encoded_topics import EncodedPublisher
from diff_encoder_sim.ros.model_states import ModelStateReader, ModelStatesParams
from diff_encoder_sim.ros.node import node_params, run_node
from diff_encoder_sim.simulation.state import PlanarVelocity


class WorldPoseParams(ModelStatesParams):
    """Parameters of world_pose_node."""

    map_frame: str = Field('map', min_length=1, description='frame of the pose')
    map_in_world: PoseParams = Field(PoseParams(), description='pose of the map frame in the world')


class WorldPoseNode:
    """Republishes one model's pose in the map frame."""

    def __init__(self) -> None:
        params = node_params(WorldPoseParams, part='world_pose')
        self._map_frame = params.map_frame
        self._world_in_map = params.map_in_world.pose().inverse()
        self._poses = EncodedPublisher('world_pose', PoseStamped)
        self._reader = ModelStateReader(params, self._on_state)

    def _on_state(self, stamp_ns: int, pose_in_world: Pose2D, _: PlanarVelocity) -> None:
        self._poses.publish(encode_pose_stamped(self._world_in_map.compose(pose_in_world), stamp_ns, self._map_frame))


def main() -> None:
    """Run the node."""
    run_node('world_pose_node', WorldPoseNode)
