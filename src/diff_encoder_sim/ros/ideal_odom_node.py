"""ideal_odom_node: odometry without error, from /gazebo/model_states, as plain simulators publish it."""

from __future__ import annotations

import math
from typing import Optional

from pydantic import Field

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.ros.model_states import ModelStateReader, ModelStatesParams
from diff_encoder_sim.ros.node import node_params, run_node
from diff_encoder_sim.ros.odometry_output import OdometryOutput
from diff_encoder_sim.simulation.state import PlanarVelocity
from diff_encoder_sim.wheels.odometry import OdometryEstimate


class IdealOdomParams(ModelStatesParams):
    """Parameters of ideal_odom_node."""

    odom_frame: str = Field('odom', min_length=1, description='frame of the pose')
    base_frame: str = Field('base_link', min_length=1, description='frame of the robot')
    publish_tf: bool = Field(True, description='broadcast odom_frame -> base_frame on TF')


class IdealOdomNode:
    """Publishes the true pose, relative to the first one, on /odom and TF."""

    def __init__(self) -> None:
        params = node_params(IdealOdomParams, part='ideal_odom')
        self._start_pose: Optional[Pose2D] = None
        self._newest_ns = 0
        self._output = OdometryOutput(params.odom_frame, params.base_frame, params.publish_tf)
        self._reader = ModelStateReader(params, self._on_state)

    def _on_state(self, stamp_ns: int, pose_in_world: Pose2D, velocity: PlanarVelocity) -> None:
        if self._start_pose is None or stamp_ns < self._newest_ns:
            self._start_pose = pose_in_world
        self._newest_ns = stamp_ns
        yaw_rad = pose_in_world.yaw_rad
        forward_mps = velocity.x_mps * math.cos(yaw_rad) + velocity.y_mps * math.sin(yaw_rad)
        self._output.publish(
            OdometryEstimate(stamp_ns, pose_in_world.relative_to(self._start_pose), forward_mps, velocity.yaw_radps)
        )


def main() -> None:
    """Run the node."""
    run_node('ideal_odom_node', IdealOdomNode)
