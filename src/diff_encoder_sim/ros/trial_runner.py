"""The life of a live trial: the graph comes up, time runs, somebody drives, the result is told."""

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

from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.base.typed_params import Params
from diff_encoder_sim.recording import topics
from diff_encoder_sim.ros.graph import wait_until_connected
from diff_encoder_sim.ros.launch_status import LaunchStatus
from diff_encoder_sim.ros.node import log, publisher
from diff_encoder_sim.ros.pose_subscriber import pose_subscriber
from diff_encoder_sim.ros.trial_plan import required_trial_plan
from diff_encoder_sim.trials.trial_outcome import GOAL_DISTANCE_M, Outcome, goal_error

FIRST_MESSAGES_S = 0.2  # of wall time, for latched messages on connections just made
LAST_MESSAGES_S = 0.5  # of wall time, for what is on its way into the bag
POLL_PERIOD_S = 0.1

# Each must have a publisher that all its subscribers hear before time may run.
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

# Of what else is recorded nothing must be missed either, as far as the trial has it.
ALSO_RECORDED = tuple(topic for topic in topics.RECORDED if topic not in GRAPH)


class TrialParams(Params):
    """Parameters of every node that runs a trial."""

    odom_frame: str = Field('odom', min_length=1, description='frame of the odometry')
    map_frame: str = Field('map', min_length=1, description='frame of goals')
    start_timeout: float = Field(60.0, gt=0, description='wall time for the graph to start [s]')
    stall_timeout: float = Field(20.0, gt=0, description='wall time without a true pose before the trial fails [s]')
    goal_distance: float = Field(
        GOAL_DISTANCE_M, gt=0, description='a true pose farther from the goal fails the trial [m]'
    )


class TrialFailed(Exception):
    """Why the trial did not end; unless another outcome is given, the ROS graph failed."""

    def __init__(self, reason: str, outcome: Outcome = Outcome.FAILED) -> None:
        super().__init__(reason)
        self.outcome = outcome


class TrialRunner:
    """Starts a trial, watches over it, and reports how it ended; driving is others' work."""

    def __init__(self, status: LaunchStatus, params: TrialParams, on_world_pose: Callable[[int, Pose2D], None]) -> None:
        """`on_world_pose` is called with (stamp_ns, true pose in the map) at 20 Hz."""
        self._status = status
        self._params = params
        self._on_true_pose = on_world_pose
        plan = required_trial_plan()
        self.trial = plan.trial
        self._record = f'bag: {plan.bag}' if plan.bag else 'no bag'
        self._true_pose: Optional[Pose2D] = None
        self._last_heard_s = time.monotonic()
        self._info = publisher(topics.TRIAL, String, latch=True)
        self._result = publisher(topics.TRIAL_RESULT, String, latch=True)
        self._info.publish(String(self.trial.model_dump_json()))
        self._world_pose = pose_subscriber(topics.WORLD_POSE, self._on_world_pose)

    def run(self, drive: Callable[[], None], also_heard: Sequence[str] = ()) -> None:
        """Let time run, `drive`, and tell the result; exits with status 1 when it failed.

        Args:
            drive: returns when the driving is done; raises TrialFailed.
            also_heard: topics that must be connected, too, before time runs.
        """
        try:
            self._start(also_heard)
            drive()
            self._check_goal()
        except TrialFailed as failure:
            self._report(failure.outcome, str(failure))
            rospy.logerr('trial failed: %s', failure)
            sys.exit(1)
        self._report(Outcome.SUCCEEDED, '')
        rospy.loginfo('trial succeeded; %s', self._record)
        self._status.succeed()

    def wait_for(self, is_done: Callable[[], bool]) -> None:
        """Block until `is_done`.

        Raises:
            TrialFailed: the trial was stopped, or simulated time stands still.
        """
        while not is_done():
            if rospy.is_shutdown():
                raise TrialFailed('stopped before its end')
            if time.monotonic() - self._last_heard_s > self._params.stall_timeout:
                raise TrialFailed(f'no {topics.WORLD_POSE} for {self._params.stall_timeout:.0f} s')
            time.sleep(POLL_PERIOD_S)

    def _start(self, also_heard: Sequence[str]) -> None:
        missing = wait_until_connected((*GRAPH, *also_heard), ALSO_RECORDED, self._params.start_timeout)
        if rospy.is_shutdown():
            raise TrialFailed('stopped before it began')
        if missing:
            raise TrialFailed(f'after {self._params.start_timeout:.0f} s still not connected: {", ".join(missing)}')
        time.sleep(FIRST_MESSAGES_S)
        self._last_heard_s = time.monotonic()
        _call('/gazebo/unpause_physics')

    def _check_goal(self) -> None:
        goal = self.trial.goal()
        log.info('%s ends %s', topics.WORLD_POSE, distance_from_goal(self._true_pose, goal))
        reason = goal_error(self._true_pose, goal, self._params.goal_distance)
        if reason is not None:
            raise TrialFailed(reason, Outcome.LOST)

    def _on_world_pose(self, stamp_ns: int, base_pose_in_map: Pose2D) -> None:
        self._true_pose = base_pose_in_map
        self._last_heard_s = time.monotonic()
        self._on_true_pose(stamp_ns, base_pose_in_map)

    def _report(self, outcome: Outcome, reason: str) -> None:
        if rospy.is_shutdown():
            return
        _call('/gazebo/pause_physics')
        self._result.publish(String(json.dumps({'outcome': outcome.value, 'reason': reason})))
        time.sleep(LAST_MESSAGES_S)


def distance_from_goal(pose: Pose2D, goal: Pose2D) -> str:
    """How far off, for people: distance and angle, both without sign."""
    distance_m = math.hypot(pose.x_m - goal.x_m, pose.y_m - goal.y_m)
    angle_deg = abs(math.degrees(wrap_angle(pose.yaw_rad - goal.yaw_rad)))
    return f'{distance_m:.3f} m and {angle_deg:.1f} degrees from the goal'


def _call(service: str) -> None:
    try:
        rospy.ServiceProxy(service, Empty)()
    except rospy.ServiceException as error:
        log.warning('%s: %s', service, error)
