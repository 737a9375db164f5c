"""The course of a live trial: the nodes connect, time runs, a node drives, the result is published."""

from __future__ import annotations

import json
import math
import sys
import time
from typing import Callable, Optional, Sequence

import rospy
from pydantic import Field
from std_msgs.msg import String
from std_srvs.srv import Empty

from diff_encoder_sim.base.bounds import PositiveDistance_m, PositiveDuration_s
from diff_encoder_sim.base.params import Params
from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.trial_definition import GOAL_DISTANCE_M, Outcome, goal_error
from diff_encoder_sim.ros.encoded_topics import pose_subscriber
from diff_encoder_sim.ros.graph import NodeWatch, wait_until_connected
from diff_encoder_sim.ros.launch_status import LaunchStatus
from diff_encoder_sim.ros.node import call_service, log, publisher, required_trial_plan

FIRST_MESSAGES_S = 0.2  # of wall time, for latched messages on connections just made
LAST_MESSAGES_S = 0.5  # of wall time, for what is on its way into the bag
POLL_PERIOD_S = 0.02

# Each must have a publisher that all its subscribers are connected to before time runs.
GRAPH = (
    '/clock',
    '/joint_states',
    '/gazebo/model_states',
    topics.TRIAL,
    topics.TRIAL_RESULT,
    topics.ODOM,
    topics.WORLD_POSE,
    topics.GLOBAL_POSE,
    '/cmd_vel',
    '/tf',
    '/tf_static',
)

# As trial.launch calls the node that writes the bag; without a bag it does not run.
RECORDER = '/record_trial'

# Other recorded topics, which not every trial has: where they are published, the recorder must be connected as well.
ALSO_RECORDED = tuple(topic for topic in topics.RECORDED_LIVE if topic not in GRAPH)


class TrialParams(Params):
    """Parameters of every node that runs a trial."""

    odom_frame: str = Field('odom', min_length=1, description='frame of the odometry')
    map_frame: str = Field('map', min_length=1, description='frame of goals')
    start_timeout: PositiveDuration_s = Field(60.0, description='wall time for the graph to start [s]')
    stall_timeout: PositiveDuration_s = Field(
        20.0, description='wall time without a true pose or a response of a node, before the trial fails [s]'
    )
    goal_distance: PositiveDistance_m = Field(
        GOAL_DISTANCE_M, description='a true pose farther from the goal fails the trial [m]'
    )


class TrialFailed(Exception):
    """Why the trial did not end; unless another outcome is given, the ROS graph failed."""

    def __init__(self, reason: str, outcome: Outcome = Outcome.FAILED) -> None:
        super().__init__(reason)
        self.outcome = outcome


class TrialRunner:
    """Starts a trial, supervises it, and reports its outcome; its owner drives."""

    def __init__(self, status: LaunchStatus, params: TrialParams, on_world_pose: Callable[[int, Pose2D], None]) -> None:
        """Publish /trial; `on_world_pose` is called with (stamp_ns, true pose in the map) for each /world_pose."""
        self._status = status
        self._params = params
        self._on_true_pose = on_world_pose
        plan = required_trial_plan()
        self.trial = plan.trial
        self._record = f'bag: {plan.bag}' if plan.bag else 'no bag'
        self._true_pose: Optional[Pose2D] = None
        self._last_pose_s = time.monotonic()
        self._nodes = NodeWatch(params.stall_timeout)
        self._info = publisher(topics.TRIAL, String, latch=True)
        self._result = publisher(topics.TRIAL_RESULT, String, latch=True)
        self._info.publish(String(self.trial.model_dump_json()))
        self._world_pose = pose_subscriber(topics.WORLD_POSE, self._on_world_pose)

    def run(self, drive: Callable[[], None], also_connected: Sequence[str] = ()) -> None:
        """Let time run, `drive`, and report the outcome; exits with status 1 when the trial failed.

        Args:
            drive: returns at the end of the drive; raises TrialFailed.
            also_connected: more topics that must be connected before time runs.
        """
        try:
            self._start(also_connected)
            drive()
            _call('/gazebo/pause_physics')  # before the nodes are asked, which takes a while: the bag ends here
            self._check_nodes()
            self._check_goal()
        except TrialFailed as failure:
            rospy.logerr('trial failed: %s; %s', failure, self._record)  # first: what follows takes a while
            if not rospy.is_shutdown():
                _call('/gazebo/pause_physics')
            self._report(failure.outcome, str(failure))
            sys.exit(1)
        self._report(Outcome.SUCCEEDED, '')
        rospy.loginfo('trial succeeded; %s; roslaunch stops all nodes now', self._record)
        self._status.succeed()

    def wait_for(self, is_done: Callable[[], bool]) -> None:
        """Block until `is_done`.

        Raises:
            TrialFailed: the trial was stopped, simulated time stands still, or a node does not respond.
        """
        while not is_done():
            if rospy.is_shutdown():
                raise TrialFailed('stopped before its end')
            if time.monotonic() - self._last_pose_s > self._params.stall_timeout:
                raise TrialFailed(f'no {topics.WORLD_POSE} for {self._params.stall_timeout:.0f} s')
            if self._nodes.failure is not None:
                raise TrialFailed(self._nodes.failure)
            time.sleep(POLL_PERIOD_S)

    def _start(self, also_connected: Sequence[str]) -> None:
        missing = wait_until_connected((*GRAPH, *also_connected), ALSO_RECORDED, self._params.start_timeout)
        if rospy.is_shutdown():
            raise TrialFailed('stopped before it began')
        if missing:
            raise TrialFailed(f'topics not connected within {self._params.start_timeout:.0f} s: {", ".join(missing)}')
        self._nodes.start((*GRAPH, *also_connected), [RECORDER])
        time.sleep(FIRST_MESSAGES_S)
        self._last_pose_s = time.monotonic()
        _call('/gazebo/unpause_physics')

    def _check_nodes(self) -> None:
        failure = self._nodes.check()
        if failure is not None:
            raise TrialFailed(failure)

    def _check_goal(self) -> None:
        goal, true_pose = self.trial.goal(), self._true_pose
        if true_pose is None:
            raise TrialFailed(f'no {topics.WORLD_POSE} has been received')
        log.info('true pose (%s): %s', topics.WORLD_POSE, distance_from_goal(true_pose, goal))
        reason = goal_error(true_pose, goal, self._params.goal_distance)
        if reason is not None:
            raise TrialFailed(reason, Outcome.LOST)

    def _on_world_pose(self, stamp_ns: int, base_pose_in_map: Pose2D) -> None:
        self._true_pose = base_pose_in_map
        self._last_pose_s = time.monotonic()
        self._on_true_pose(stamp_ns, base_pose_in_map)

    def _report(self, outcome: Outcome, reason: str) -> None:
        if rospy.is_shutdown():
            return
        self._result.publish(String(json.dumps({'outcome': outcome.value, 'reason': reason})))
        time.sleep(LAST_MESSAGES_S)


def distance_from_goal(pose: Pose2D, goal: Pose2D) -> str:
    """Format how far a pose is from the goal: distance and angle, both without sign."""
    distance_m = math.hypot(pose.x_m - goal.x_m, pose.y_m - goal.y_m)
    angle_deg = abs(math.degrees(wrap_angle(pose.yaw_rad - goal.yaw_rad)))
    return f'{distance_m:.3f} m and {angle_deg:.1f} degrees from the goal'


def _call(service: str) -> None:
    try:
        call_service(service, Empty)
    except rospy.ServiceException as error:
        log.warning('%s: %s', service, error)
