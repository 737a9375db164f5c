"""Perfect odometry, for odom:=ideal: what Gazebo's own plugin would give."""
from __future__ import annotations

import math

import numpy as np

from diff_encoder_sim.odometry import OdometryEstimate
from diff_encoder_sim.ros.odometry_output import OdometryOutput
from diff_encoder_sim.se2 import Pose2D, yaw_from_quat_xyzw
from diff_encoder_sim.simulation.state import BodyState


class IdealOdometry:
    """Publishes the true pose, as seen from the start, on `odom` and TF."""

    def __init__(self, start_pose: Pose2D) -> None:
        self._start_pose = start_pose
        self._output = OdometryOutput('odom', 'base_link', publish_tf=True)

    def publish(self, stamp_ns: int, state: BodyState) -> None:
        """Send one estimate without error; covariances are zero."""
        yaw_rad = yaw_from_quat_xyzw(*state.quat_xyzw)
        pose = Pose2D(state.position_xyz_m[0], state.position_xyz_m[1], yaw_rad)
        forward_mps = (state.linear_xyz_mps[0] * math.cos(yaw_rad)
                       + state.linear_xyz_mps[1] * math.sin(yaw_rad))
        self._output.publish(OdometryEstimate(
            stamp_ns, pose.relative_to(self._start_pose), forward_mps,
            state.angular_xyz_radps[2], np.zeros((3, 3)), np.zeros((2, 2))))
