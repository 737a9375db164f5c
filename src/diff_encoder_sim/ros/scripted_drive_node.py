"""scripted_drive_node: publishes a test's drive on /cmd_vel, without feedback, and ends with the trial."""

from __future__ import annotations

import threading
from typing import Optional

import tf2_ros
from geometry_msgs.msg import Twist

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.sensor_messages import encode_command
from diff_encoder_sim.ros.conversions import transform_message
from diff_encoder_sim.ros.encoded_topics import EncodedPublisher
from diff_encoder_sim.ros.launch_status import LaunchStatus
from diff_encoder_sim.ros.maps import MapKeeper
from diff_encoder_sim.ros.node import node_params, required_trial_plan, run_node
from diff_encoder_sim.ros.trial_runner import TrialFailed, TrialParams, TrialRunner
from diff_encoder_sim.trials.scripted_drive import ScriptedDrive

# What must be connected before time runs, by `slam`: simulated time waits for the embedded one's pose.
TOPICS_OF_SLAM = {'embedded': ('/scan', '/map', '/slam_gmapping/pose'), 'upstream': ('/scan', '/map')}


class ScriptedDriveNode:
    """Drives without feedback: of /world_pose only the stamps are used."""

    def __init__(self, status: LaunchStatus) -> None:
        params = node_params(TrialParams)
        self._start_ns: Optional[int] = None
        self._finished = threading.Event()
        self._commands = EncodedPublisher('cmd_vel', Twist)
        self._runner = TrialRunner(status, params, self._on_true_pose)
        self._drive = ScriptedDrive(self._runner.trial.test)
        plan = required_trial_plan()
        # SLAM may have to compile first; the robot does not drive before it has subscribed.
        self._also_connected = TOPICS_OF_SLAM.get(plan.slam, ())
        if plan.slam == 'none':
            self._broadcast_start(params)
        self._map_keeper = MapKeeper(plan.save_map) if plan.save_map else None

    def run(self) -> None:
        """Run the trial; returns at its end."""
        try:
            self._runner.run(self._drive_and_map, self._also_connected)
        finally:
            if self._map_keeper is not None and self._map_keeper.has_unsaved:
                self._map_keeper.save()  # the map so far, of a trial that failed

    def _drive_and_map(self) -> None:
        self._runner.wait_for(self._finished.is_set)
        if self._map_keeper is not None:
            try:
                self._map_keeper.save()
            except ConfigError as error:
                raise TrialFailed(str(error)) from None

    def _on_true_pose(self, stamp_ns: int, _: Pose2D) -> None:
        if self._start_ns is None or stamp_ns < self._start_ns:  # time was reset: from the start
            self._start_ns = stamp_ns
        elapsed_s = (stamp_ns - self._start_ns) / NANOSECONDS_PER_SECOND
        self._commands.publish(encode_command(*self._drive.command_at(elapsed_s)))
        if self._drive.is_over(elapsed_s):
            self._finished.set()

    def _broadcast_start(self, params: TrialParams) -> None:
        """Publish map -> odom for a trial without localization: odom is at the surveyed start."""
        self._static_transforms = tf2_ros.StaticTransformBroadcaster()
        self._static_transforms.sendTransform(
            transform_message(self._runner.trial.test.start.pose(), 0, params.map_frame, params.odom_frame)
        )


def main(status: LaunchStatus) -> None:
    """Run the node."""
    run_node('scripted_drive_node', lambda: ScriptedDriveNode(status), ScriptedDriveNode.run)
