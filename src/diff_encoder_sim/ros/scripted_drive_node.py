"""scripted_drive_node: drives a test's script over /cmd_vel, and ends with the trial."""
from __future__ import annotations

import json
import math
import sys
import threading
import time
from typing import Optional

import rospy
import tf2_ros
from geometry_msgs.msg import PoseStamped, Twist, Vector3
from pydantic import Field
from std_msgs.msg import String
from std_srvs.srv import Empty

from diff_encoder_sim.config import Params
from diff_encoder_sim.encoder import EncoderParams
from diff_encoder_sim.errors import InputFault
from diff_encoder_sim.experiments.drives import ScriptedDrive
from diff_encoder_sim.odometry import OdometryParams
from diff_encoder_sim.recording import topics
from diff_encoder_sim.ros.conversions import ns_from_stamp, pose_from_message, transform_message
from diff_encoder_sim.ros.graph import wait_until_heard
from diff_encoder_sim.ros.launch_status import LaunchStatus
from diff_encoder_sim.ros.node import log, node_params, publisher, run_node, subscriber
from diff_encoder_sim.ros.trial_plan import required_trial_plan
from diff_encoder_sim.se2 import Pose2D
from diff_encoder_sim.timeline import NANOSECONDS_PER_SECOND

COMMAND_PERIOD_S = 0.05
SETTLING_S = 1.0          # of simulated time, at rest, before the result counts
LAST_MESSAGES_S = 0.5     # of wall time, for what is on its way into the bag

# Each must have a publisher that all its subscribers hear before time may run.
GRAPH = ('/clock', '/joint_states', '/gazebo/model_states', topics.TRIAL, topics.TRIAL_RESULT,
         topics.ODOM, topics.WORLD_POSE, topics.GLOBAL_POSE, '/cmd_vel', '/tf', '/tf_static')


class ScriptedDriveParams(Params):
    """Parameters of scripted_drive_node."""

    odom_frame: str = Field('odom', min_length=1)
    map_frame: str = Field('map', min_length=1)
    start_timeout: float = Field(60.0, gt=0, description='for the graph to come up [s of wall]')
    stall_timeout: float = Field(20.0, gt=0, description='without a true pose [s of wall]')
    goal_distance: float = Field(0.5, gt=0, description='truth farther off fails the trial [m]')


class TrialFailed(Exception):
    """Why the trial did not come to its end."""


class ScriptedDriveNode:
    """One trial: waits for the graph, lets time run, drives, and reports how it ended.

    The script runs on the stamps of /world_pose. Only the stamps: the drive is open loop.
    """

    def __init__(self, status: LaunchStatus) -> None:
        self._status = status
        self._params = node_params(ScriptedDriveParams, EncoderParams, OdometryParams)
        plan = required_trial_plan()
        self._trial = plan.trial
        self._record = f'bag: {plan.bag}' if plan.bag else 'no bag'
        self._drive = ScriptedDrive(self._trial.test)
        self._start_ns: Optional[int] = None
        self._true_pose: Optional[Pose2D] = None
        self._last_heard_s = time.monotonic()
        self._finished = threading.Event()
        self._broadcast_start()
        self._commands = publisher('cmd_vel', Twist)
        self._info = publisher(topics.TRIAL, String, latch=True)
        self._result = publisher(topics.TRIAL_RESULT, String, latch=True)
        self._info.publish(String(self._trial.model_dump_json()))
        self._world_pose = subscriber(topics.WORLD_POSE, PoseStamped, self._on_world_pose)

    def run(self) -> None:
        """Blocks until the trial is over; exits with status 1 when it failed."""
        try:
            self._start()
            self._wait_for_the_end()
            self._check_goal()
        except TrialFailed as failure:
            self._report('failed', str(failure))
            rospy.logerr('trial failed: %s', failure)
            sys.exit(1)
        self._report('succeeded', '')
        rospy.loginfo('trial succeeded; %s', self._record)
        self._status.succeed()

    def _start(self) -> None:
        missing = wait_until_heard(GRAPH, self._params.start_timeout)
        if rospy.is_shutdown():
            raise TrialFailed('stopped before it began')
        if missing:
            raise TrialFailed(f'after {self._params.start_timeout:.0f} s still not connected: '
                              f'{", ".join(missing)}')
        self._last_heard_s = time.monotonic()
        _call('/gazebo/unpause_physics')

    def _wait_for_the_end(self) -> None:
        while not self._finished.wait(0.1):
            if rospy.is_shutdown():
                raise TrialFailed('stopped before its end')
            if time.monotonic() - self._last_heard_s > self._params.stall_timeout:
                raise TrialFailed(f'no {topics.WORLD_POSE} for '
                                  f'{self._params.stall_timeout:.0f} s')

    def _check_goal(self) -> None:
        goal = self._trial.test.goal()
        distance_m = math.hypot(self._true_pose.x_m - goal.x_m, self._true_pose.y_m - goal.y_m)
        if distance_m > self._params.goal_distance:
            raise TrialFailed(f'the robot stands {distance_m:.2f} m from the goal; allowed: '
                              f'{self._params.goal_distance:.2f} m')

    def _on_world_pose(self, message: PoseStamped) -> None:
        try:
            self._true_pose = pose_from_message(message.pose)
        except InputFault as fault:
            log.warning('%s: %s; message dropped', topics.WORLD_POSE, fault)
            return
        self._last_heard_s = time.monotonic()
        stamp_ns = ns_from_stamp(message.header.stamp)
        if self._start_ns is None or stamp_ns < self._start_ns:  # time was reset: from the top
            self._start_ns = stamp_ns
        elapsed_s = (stamp_ns - self._start_ns) / NANOSECONDS_PER_SECOND
        linear_mps, angular_radps = self._drive.command(elapsed_s, elapsed_s + COMMAND_PERIOD_S)
        self._commands.publish(Twist(Vector3(linear_mps, 0, 0), Vector3(0, 0, angular_radps)))
        if elapsed_s > self._drive.duration_s + SETTLING_S:
            self._finished.set()

    def _broadcast_start(self) -> None:
        """Without localization the map is where the surveyed start says: odom stands there."""
        self._static_transforms = tf2_ros.StaticTransformBroadcaster()
        self._static_transforms.sendTransform(transform_message(
            self._trial.test.start.pose(), 0, self._params.map_frame, self._params.odom_frame))

    def _report(self, outcome: str, reason: str) -> None:
        if rospy.is_shutdown():
            return
        _call('/gazebo/pause_physics')
        self._result.publish(String(json.dumps({'outcome': outcome, 'reason': reason})))
        time.sleep(LAST_MESSAGES_S)


def _call(service: str) -> None:
    try:
        rospy.ServiceProxy(service, Empty)()
    except rospy.ServiceException as error:
        log.warning('%s: %s', service, error)


def main() -> None:
    """Entry point of the executable."""
    # First of all, so that whatever goes wrong from here on fails the launch.
    status = LaunchStatus()
    run_node('scripted_drive_node', lambda: ScriptedDriveNode(status), ScriptedDriveNode.run)
