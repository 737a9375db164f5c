"""Nodes that drive a live trial: navigation_trial_node and scripted_drive_node."""

from __future__ import annotations

import json
import math
import sys
import time
from typing import Callable, Optional, Tuple

import actionlib
import rospy
from actionlib_msgs.msg import GoalStatus as ActionStatus
from geometry_msgs.msg import Twist
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal
from pydantic import Field
from std_msgs.msg import String
from std_srvs.srv import Empty
from tf2_msgs.msg import TFMessage

from diff_encoder_sim.base.bounds import PositiveDistance_m, PositiveDuration_s
from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.params import Params
from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.message_encoders import encode_command, encode_planar_tf
from diff_encoder_sim.drives.trial_definition import GOAL_DISTANCE_M, Outcome, RouteFailed, goal_error
from diff_encoder_sim.navigation.navigator_inputs import GoalStatus
from diff_encoder_sim.ros import node
from diff_encoder_sim.ros.launch_status import LaunchStatus
from diff_encoder_sim.ros.maps import MapKeeper
from diff_encoder_sim.ros.messages import Publisher, pose_stamped_message, pose_subscriber
from diff_encoder_sim.trials.route_driver import DriverOutput, RouteDriver
from diff_encoder_sim.trials.scripted_drive import ScriptedDrive

FIRST_MESSAGES_S = 0.2  # wall time for latched messages on new connections
LAST_MESSAGES_S = 0.5  # wall time for the last messages to reach the bag
POLL_PERIOD_S = 0.02

# Each must have a publisher that all its subscribers are connected to before time runs.
GRAPH = (
    *('/clock', '/joint_states', '/gazebo/model_states', topics.TRIAL, topics.TRIAL_RESULT, topics.ODOM),
    *(topics.WORLD_POSE, topics.GLOBAL_POSE, '/cmd_vel', '/tf', '/tf_static'),
)

# Other recorded topics, which not every trial has: where they are published, the recorder must be connected as well.
ALSO_RECORDED = tuple(topic for topic in topics.RECORDED_LIVE if topic not in GRAPH)


class TrialParams(Params):
    """Parameters of nodes that run a trial."""

    odom_frame: str = Field('odom', min_length=1, description='frame of the odometry')
    map_frame: str = Field('map', min_length=1, description='frame of goals')
    start_timeout: PositiveDuration_s = Field(60.0, description='wall time for the graph to start [s]')
    stall_timeout: PositiveDuration_s = Field(20.0, description='wall time without a true pose that ends the trial [s]')
    goal_distance: PositiveDistance_m = Field(GOAL_DISTANCE_M, description='most between true pose and goal [m]')


class TrialNode:
    """Starts and supervises a trial; subclasses `drive`, with the poses of /world_pose from `on_true_pose`."""

    def __init__(self, status: LaunchStatus, *connected: str) -> None:
        """Publish the trial; `connected` topics are connected before time starts, next to those of GRAPH."""
        self.params, self.plan = node.node_params(TrialParams), node.required_trial_plan()
        self.trial = self.plan.trial
        self._status, self._graph = status, (*GRAPH, self.trial.odometry_topic, *connected)
        self._record = f'bag: {self.plan.bag}' if self.plan.bag else 'no bag'
        self._true_pose, self._last_pose_s = self.trial.test.start.pose(), time.monotonic()
        self._result = Publisher(topics.TRIAL_RESULT, String, latch=True)
        Publisher(topics.TRIAL, String, latch=True).publish(String(self.trial.model_dump_json()))
        pose_subscriber(topics.WORLD_POSE, self._on_world_pose)

    def drive(self) -> None:
        """Drive to the end of the trial; RouteFailed if that is not possible."""

    def on_true_pose(self, stamp_ns: int) -> None:
        """Handle a true pose by its stamp."""

    def run(self) -> None:
        """Start simulated time, `drive`, and report the outcome; exit with status 1 if the trial failed."""
        timeout_s = self.params.start_timeout
        try:
            missing = node.wait_until_connected(self._graph, ALSO_RECORDED, timeout_s)
            if rospy.is_shutdown():
                raise RouteFailed(Outcome.FAILED, 'stopped before its start')
            if missing:
                reason = f'topics not connected within {timeout_s:.0f} s: {", ".join(missing)}'
                raise RouteFailed(Outcome.FAILED, reason)
            time.sleep(FIRST_MESSAGES_S)
            self._last_pose_s = time.monotonic()
            _call('/gazebo/unpause_physics')
            self.drive()
            _call('/gazebo/pause_physics')  # ends the bag before the slow shutdown
            goal = self.trial.goal()
            node.log.info('true pose (%s): %s', topics.WORLD_POSE, distance_from_goal(self._true_pose, goal))
            error = goal_error(self._true_pose, goal, self.params.goal_distance)
            if error is not None:
                raise RouteFailed(Outcome.LOST, error)
        except RouteFailed as failure:
            rospy.logerr('trial failed: %s; %s', failure, self._record)  # first, as the shutdown is slow
            if not rospy.is_shutdown():
                _call('/gazebo/pause_physics')
            self._report(*failure.ending)
            sys.exit(1)
        self._report(Outcome.SUCCEEDED, '')
        rospy.loginfo('trial succeeded; %s; shutting down', self._record)
        self._status.succeed()

    def wait_for(self, is_done: Callable[[], bool]) -> None:
        """Block until `is_done`; RouteFailed if the trial was stopped, or simulated time does not advance."""
        while not is_done():
            if rospy.is_shutdown():
                raise RouteFailed(Outcome.FAILED, 'stopped before its end')
            if time.monotonic() - self._last_pose_s > self.params.stall_timeout:
                raise RouteFailed(Outcome.FAILED, f'no {topics.WORLD_POSE} for {self.params.stall_timeout:.0f} s')
            time.sleep(POLL_PERIOD_S)

    def _on_world_pose(self, stamp_ns: int, base_pose_in_map: Pose2D) -> None:
        self._true_pose, self._last_pose_s = base_pose_in_map, time.monotonic()
        self.on_true_pose(stamp_ns)

    def _report(self, outcome: Outcome, reason: str) -> None:
        if not rospy.is_shutdown():
            self._result.publish(String(json.dumps({'outcome': outcome.value, 'reason': reason})))
            time.sleep(LAST_MESSAGES_S)


def distance_from_goal(pose: Pose2D, goal: Pose2D) -> str:
    """Format the absolute distance and angle between a pose and the goal."""
    distance_m = math.hypot(pose.x_m - goal.x_m, pose.y_m - goal.y_m)
    angle_deg = abs(math.degrees(wrap_angle(pose.yaw_rad - goal.yaw_rad)))
    return f'{distance_m:.3f} m and {angle_deg:.1f} degrees from the goal'


def _call(service: str) -> None:
    try:
        node.call_service(service, Empty)
    except rospy.ServiceException as error:
        node.log.warning('%s: %s', service, error)


ACTION = 'move_base'
_RUNNING = (ActionStatus.PENDING, ActionStatus.ACTIVE, ActionStatus.PREEMPTING, ActionStatus.RECALLING)
_ENDED = {ActionStatus.SUCCEEDED: GoalStatus.SUCCEEDED, ActionStatus.PREEMPTED: GoalStatus.PREEMPTED}


class NavigationTrialNode(TrialNode):
    """Sends a test's route to move_base, goal by goal, and ends with the trial."""

    def __init__(self, status: LaunchStatus) -> None:
        is_upstream = node.required_trial_plan().trial.nav == 'upstream'
        of_embedded = () if is_upstream else (f'/{ACTION}/status', '/amcl/scan_taken')
        super().__init__(status, '/scan', '/amcl_pose', '/map', *of_embedded)
        self._driver = RouteDriver(self.trial.test)
        self._estimate: Optional[Pose2D] = None
        self._failure: Optional[RouteFailed] = None
        self._is_over = False
        self._goal: Optional[actionlib.ClientGoalHandle] = None
        # The upstream move_base advertises its action only when time runs and AMCL localizes.
        self._may_drive = not is_upstream
        self._commands = Publisher('cmd_vel', Twist)
        # SimpleActionClient would log an error for the status of an unregistered goal.
        self._action = actionlib.ActionClient(ACTION, MoveBaseAction)
        pose_subscriber(topics.GLOBAL_POSE, self._on_global_pose)

    def drive(self) -> None:
        """Wait for the driver, and report its failure."""
        self.wait_for(lambda: self._may_drive or self._is_served())
        self._may_drive = True
        self.wait_for(self._has_ended)
        if self._failure is not None:
            self._action.cancel_all_goals()
            self._commands.publish(encode_command(0.0, 0.0))  # ends a turn in place
            raise self._failure
        if self._estimate is not None:
            distance = distance_from_goal(self._estimate, self.trial.goal())
            node.log.info('estimated pose (%s): %s', topics.GLOBAL_POSE, distance)

    def _has_ended(self) -> bool:
        return self._failure is not None or self._is_over

    def _is_served(self) -> bool:
        # It would wait by simulated time, which may stand still. With a limit a second ago it only looks once.
        a_second = rospy.Duration(1.0)
        return rospy.Time.now() >= rospy.Time() + a_second and bool(self._action.wait_for_server(-a_second))

    def on_true_pose(self, stamp_ns: int) -> None:
        """Check the time limits of the driver, also without a pose estimate."""
        self._drive_on(stamp_ns, lambda: self._driver.watch(stamp_ns))

    def _on_global_pose(self, stamp_ns: int, base_pose_in_map: Pose2D) -> None:
        if self._may_drive and not self._has_ended():
            self._estimate = base_pose_in_map
            self._drive_on(stamp_ns, lambda: self._driver.step(stamp_ns, base_pose_in_map, *self._goal_status()))

    def _drive_on(self, stamp_ns: int, decide: Callable[[], DriverOutput]) -> None:
        if self._has_ended():
            return
        try:
            output = decide()
        except RouteFailed as failure:
            self._failure = failure
            return
        if output.turn_rate_radps is not None:
            self._commands.publish(encode_command(0.0, output.turn_rate_radps))
        if output.goal_in_map is not None:
            target = pose_stamped_message(output.goal_in_map, stamp_ns, self.params.map_frame)
            self._goal = self._action.send_goal(MoveBaseGoal(target_pose=target))
        self._is_over = self._driver.is_over  # after the last command

    def _goal_status(self) -> Tuple[GoalStatus, str]:
        if self._goal is None:
            return GoalStatus.NONE, ''
        status = self._goal.get_goal_status()
        ended = _ENDED.get(status, GoalStatus.ABORTED)
        return GoalStatus.ACTIVE if status in _RUNNING else ended, self._goal.get_goal_status_text()


# Topics to connect before time starts, by `slam`; simulated time waits for the pose of the embedded one, once compiled.
TOPICS_OF_SLAM = {'embedded': ('/scan', '/map', '/slam_gmapping/pose'), 'upstream': ('/scan', '/map')}


class ScriptedDriveNode(TrialNode):
    """Publishes a test's drive on /cmd_vel, by the stamps of /world_pose without feedback, and ends with the trial."""

    def __init__(self, status: LaunchStatus) -> None:
        super().__init__(status, *TOPICS_OF_SLAM.get(node.required_trial_plan().slam, ()))
        self._start_ns: Optional[int] = None
        self._is_over = False
        self._commands = Publisher('cmd_vel', Twist)
        self._drive = ScriptedDrive(self.trial.test)
        if self.plan.slam == 'none':  # odom is at the surveyed start
            frames = self.params.map_frame, self.params.odom_frame
            transform = encode_planar_tf(self.trial.test.start.pose(), 0, *frames)
            Publisher('/tf_static', TFMessage, latch=True).publish(transform)
        self._map_keeper = MapKeeper(self.plan.save_map) if self.plan.save_map else None

    def run(self) -> None:
        """Run the trial; save the map also after a failed one."""
        try:
            super().run()
        finally:
            if self._map_keeper is not None and self._map_keeper.has_unsaved:
                self._map_keeper.save()

    def drive(self) -> None:
        """Wait for the end of the drive, and save the map."""
        self.wait_for(lambda: self._is_over)
        if self._map_keeper is not None:
            try:
                self._map_keeper.save()
            except (ConfigError, InputFault) as error:
                raise RouteFailed(Outcome.FAILED, str(error)) from None

    def on_true_pose(self, stamp_ns: int) -> None:
        """Publish the command of this time."""
        if self._start_ns is None or stamp_ns < self._start_ns:  # time was reset: restart
            self._start_ns = stamp_ns
        elapsed_s = (stamp_ns - self._start_ns) / NANOSECONDS_PER_SECOND
        self._commands.publish(encode_command(*self._drive.command_at(elapsed_s)))
        self._is_over |= self._drive.is_over(elapsed_s)


navigation_trial_node = node.executable('navigation_trial_node', NavigationTrialNode, NavigationTrialNode.run)
scripted_drive_node = node.executable('scripted_drive_node', ScriptedDriveNode, ScriptedDriveNode.run)
