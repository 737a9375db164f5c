"""move_base_node: navigation on upstream move_base's action, topics, services and parameters."""
from __future__ import annotations

import threading
import time
from typing import Optional

import actionlib
import rospy
import tf2_ros
from geometry_msgs.msg import PoseStamped, Twist, Vector3
from move_base_msgs.msg import (MoveBaseAction, MoveBaseActionGoal, MoveBaseFeedback, MoveBaseGoal,
                                MoveBaseResult)
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.msg import Odometry
from nav_msgs.srv import GetPlan, GetPlanRequest, GetPlanResponse
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse

from diff_encoder_sim.errors import ConfigError, InputFault
from diff_encoder_sim.navigation.navigator import Navigator
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from diff_encoder_sim.navigation.outcome import STOP, Command, GoalStatus
from diff_encoder_sim.navigation.plan_error import PlanError
from diff_encoder_sim.ros.conversions import (ns_from_stamp, pose_from_message,
                                              pose_from_transform, pose_stamped_message,
                                              scan_from_message)
from diff_encoder_sim.ros.map_client import fetch_map
from diff_encoder_sim.ros.map_conversions import grid_from_message
from diff_encoder_sim.ros.navigation_views import NavigationViews, path_message
from diff_encoder_sim.ros.node import log, node_params, publisher, run_node, subscriber
from diff_encoder_sim.se2 import Pose2D
from diff_encoder_sim.timeline import NANOSECONDS_PER_SECOND


WATCHDOG_PERIOD_S = 0.1


class MoveBaseNode:
    """Steps the navigator with each /odom message, and speaks for it."""

    def __init__(self) -> None:
        self._params = node_params(NavigatorParams)
        self._map_frame = self._params.global_costmap.global_frame
        self._odom_frame = self._params.local_costmap.global_frame
        self._base_frame = self._params.local_costmap.robot_base_frame
        self._lock = threading.RLock()  # topics, services and the action come in threads
        self._navigator: Optional[Navigator] = None
        self._map: Optional[OccupancyGridMessage] = None
        self._is_driving = False
        self._buffer = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._buffer, tcp_nodelay=True)
        self._commands = publisher('cmd_vel', Twist)
        self._goals = publisher('~goal', MoveBaseActionGoal)
        self._views = NavigationViews(self._map_frame, self._odom_frame)
        self._server = actionlib.SimpleActionServer(rospy.get_name(), MoveBaseAction,
                                                    auto_start=False)
        self._server.start()
        self._services = [rospy.Service('~make_plan', GetPlan, self._on_make_plan),
                          rospy.Service('~clear_costmaps', Empty, self._on_clear_costmaps)]
        self._simple_goals = subscriber('move_base_simple/goal', PoseStamped, self._on_simple_goal)
        self._scans = subscriber('scan', LaserScan, self._on_scan)
        self._odometry = subscriber('odom', Odometry, self._on_odometry)
        self._stepped_ns, self._stepped_at_s = 0, time.monotonic()
        self._watchdog = rospy.Timer(rospy.Duration(WATCHDOG_PERIOD_S), self._on_watchdog,
                                     reset=True)
        fetch_map(self._on_map)

    # ---- arrivals

    def _on_map(self, message: OccupancyGridMessage) -> None:
        with self._lock:
            self._map = message

    def _on_scan(self, message: LaserScan) -> None:
        try:
            with self._lock:
                if self._navigator is None and self._map is not None:
                    self._begin(message.header.frame_id)
                if self._navigator is not None:
                    self._navigator.take_scan(scan_from_message(message))
        except (InputFault, tf2_ros.TransformException) as fault:
            log.warning('%s: %s; scan dropped', self._scans.resolved_name, fault)

    def _begin(self, laser_frame: str) -> None:
        laser_pose = pose_from_transform(self._buffer.lookup_transform(
            self._base_frame, laser_frame, rospy.Time(0)))
        try:
            self._navigator = Navigator(self._params, grid_from_message(self._map), laser_pose)
        except ConfigError as error:
            raise InputFault(str(error)) from None

    def _on_odometry(self, message: Odometry) -> None:
        stamp_ns = ns_from_stamp(message.header.stamp)
        with self._lock:
            if self._navigator is None:
                return
            try:
                self._navigator.take_odometry(
                    stamp_ns, pose_from_message(message.pose.pose),
                    message.twist.twist.linear.x, message.twist.twist.angular.z)
            except InputFault as fault:
                log.warning('%s: %s; message dropped', self._odometry.resolved_name, fault)
                return
            self._take_localization()
            self._step(stamp_ns)

    def _take_localization(self) -> None:
        try:
            transform = self._buffer.lookup_transform(self._map_frame, self._odom_frame,
                                                      rospy.Time(0))
            self._navigator.take_localization(ns_from_stamp(transform.header.stamp),
                                              pose_from_transform(transform))
        except (tf2_ros.TransformException, InputFault) as fault:
            log.warning('/tf: %s', fault)

    # ---- one control period

    def _on_watchdog(self, _: rospy.timer.TimerEvent) -> None:
        """Stop when no odometry comes: nothing else would step, and the last command would stand."""
        with self._lock:
            silent_s = time.monotonic() - self._stepped_at_s
            age_s = (ns_from_stamp(rospy.Time.now()) - self._stepped_ns) / NANOSECONDS_PER_SECOND
            # By both clocks: a loaded machine delays messages, and a paused simulation sends none.
            if self._is_driving and min(silent_s, age_s) > self._params.input_timeout:
                log.warning('%s: none for %.1f s; stopped', self._odometry.resolved_name, age_s)
                self._command(STOP)

    def _step(self, now_ns: int) -> None:
        self._stepped_ns, self._stepped_at_s = now_ns, time.monotonic()
        self._look_for_goals()
        output = self._navigator.step(now_ns)
        if output.status is GoalStatus.ACTIVE:
            self._is_driving = True
            self._command(output.command)
            self._give_feedback(now_ns)
            if output.text:
                log.info('%s', output.text)
        elif self._is_driving:
            self._is_driving = False
            self._command(output.command)
            self._end_goal(output.status, output.text)
        self._views.show(self._navigator, now_ns)

    def _command(self, command: Command) -> None:
        self._commands.publish(Twist(Vector3(command.linear_mps, 0, 0),
                                     Vector3(0, 0, command.angular_radps)))

    def _give_feedback(self, now_ns: int) -> None:
        if self._server.is_active() and self._navigator.inputs.scan is not None:
            try:
                pose = self._navigator.inputs.base_pose_in_map
            except (AssertionError, IndexError):
                return
            self._server.publish_feedback(MoveBaseFeedback(
                base_position=pose_stamped_message(pose, now_ns, self._map_frame)))

    def _end_goal(self, status: GoalStatus, text: str) -> None:
        if not self._server.is_active():
            return
        if status is GoalStatus.SUCCEEDED:
            self._server.set_succeeded(MoveBaseResult(), text)
        elif status is GoalStatus.PREEMPTED:
            self._server.set_preempted(MoveBaseResult(), text)
        else:
            log.warning('goal given up: %s', text)
            self._server.set_aborted(MoveBaseResult(), text)

    # ---- the action and the services

    def _look_for_goals(self) -> None:
        """By asking, not by callback: the action server calls back with its own lock held."""
        if self._server.is_new_goal_available():
            goal: MoveBaseGoal = self._server.accept_new_goal()
            try:
                self._set_goal(goal.target_pose)
            except InputFault as fault:
                log.warning('goal: %s; refused', fault)
                self._server.set_aborted(MoveBaseResult(), str(fault))
        elif self._server.is_active() and self._server.is_preempt_requested():
            self._navigator.cancel()

    def _set_goal(self, target: PoseStamped) -> None:
        frame = target.header.frame_id.lstrip('/')
        if frame != self._map_frame:
            raise InputFault(f'in frame {frame!r}; expected {self._map_frame!r}')
        self._navigator.set_goal(pose_from_message(target.pose))
        self._is_driving = True

    def _on_simple_goal(self, message: PoseStamped) -> None:
        self._goals.publish(MoveBaseActionGoal(goal=MoveBaseGoal(target_pose=message)))

    def _on_make_plan(self, request: GetPlanRequest) -> GetPlanResponse:
        with self._lock:
            if self._navigator is None:
                raise rospy.ServiceException('there is no map yet')
            start: Optional[Pose2D] = (pose_from_message(request.start.pose)
                                       if request.start.header.frame_id else None)
            try:
                poses = self._navigator.make_plan(start, pose_from_message(request.goal.pose),
                                                  request.tolerance)
            except (PlanError, InputFault) as error:
                raise rospy.ServiceException(str(error)) from None
        return GetPlanResponse(plan=path_message(poses, ns_from_stamp(rospy.Time.now()),
                                                 self._map_frame))

    def _on_clear_costmaps(self, _: EmptyRequest) -> EmptyResponse:
        with self._lock:
            if self._navigator is not None:
                self._navigator.clear_costmaps()
        return EmptyResponse()


def main() -> None:
    """Entry point of the executable."""
    run_node('move_base', MoveBaseNode)
