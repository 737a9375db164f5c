"""move_base_node: navigation on upstream move_base's action, topics, services and parameters."""

from __future__ import annotations

import logging
import threading
import time
from typing import Optional

import numpy as np
import rospy
from geometry_msgs.msg import PoseStamped, Twist, Vector3
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.msg import Odometry
from nav_msgs.srv import GetPlan, GetPlanRequest, GetPlanResponse
from sensor_msgs.msg import LaserScan
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.navigation.control_rate import ControlRate
from diff_encoder_sim.navigation.goal_status import STOP, Command, GoalStatus, NavigatorOutput
from diff_encoder_sim.navigation.navigation_warm_up import warm_up
from diff_encoder_sim.navigation.navigator import Navigator
from diff_encoder_sim.navigation.navigator_inputs import MissingInput
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from diff_encoder_sim.navigation.plan_error import PlanError
from diff_encoder_sim.ros.conversions import ns_from_stamp, pose_from_message, scan_from_message, twist_std_from_message
from diff_encoder_sim.ros.goal_server import GoalServer
from diff_encoder_sim.ros.map_client import fetch_map
from diff_encoder_sim.ros.map_conversions import grid_from_message
from diff_encoder_sim.ros.navigation_views import NavigationViews, path_message
from diff_encoder_sim.ros.node import compile_first, log, node_params, publisher, run_node, subscriber
from diff_encoder_sim.ros.tf_frames import RobotFrames

WATCHDOG_PERIOD_S = 0.1


class MoveBaseNode:
    """Steps the navigator with /odom at controller_frequency, and speaks for it."""

    def __init__(self) -> None:
        self._params = node_params(NavigatorParams)
        compile_first(warm_up)
        self._lock = threading.RLock()  # topics, services and the map come in threads
        self._navigator: Optional[Navigator] = None
        self._is_driving = self._has_had_scan = False
        self._heard_ns, self._heard_at_s = 0, time.monotonic()  # the newest good /odom
        self._control_rate = ControlRate(self._params.controller_frequency)
        self._commands = publisher('cmd_vel', Twist)
        local = self._params.local_costmap
        self._frames = RobotFrames(self._params.global_costmap.global_frame, local.global_frame, local.robot_base_frame)
        self._views = NavigationViews(self._frames.map_frame, self._frames.odom_frame)
        self._goals = GoalServer(self._frames)
        self._services = [
            rospy.Service('~make_plan', GetPlan, self._on_make_plan),
            rospy.Service('~clear_costmaps', Empty, self._on_clear_costmaps),
        ]
        self._scans = subscriber('scan', LaserScan, self._on_scan)
        self._odometry = subscriber('odom', Odometry, self._on_odometry)
        self._watchdog = rospy.Timer(rospy.Duration(WATCHDOG_PERIOD_S), self._on_watchdog, reset=True)
        rospy.on_shutdown(self._on_shutdown)
        fetch_map(self._on_map)

    # ---- arrivals

    def _on_map(self, message: OccupancyGridMessage) -> None:
        try:
            navigator = Navigator(self._params, grid_from_message(message))
        except InputFault as fault:
            log.warning('map: %s; not used', fault)
            return
        with self._lock:
            self._navigator = navigator

    def _on_scan(self, message: LaserScan) -> None:
        with self._lock:
            if self._navigator is None:
                return
            try:
                mount = self._frames.laser_mount(message.header.frame_id)
                self._navigator.take_scan(mount.level(scan_from_message(message)), mount.laser_pose_in_base)
            except InputFault as fault:
                # robot_state_publisher tells of the laser only once simulated time runs.
                log.log(
                    logging.WARNING if self._has_had_scan else logging.INFO,
                    '%s: %s; scan dropped',
                    self._scans.resolved_name,
                    fault,
                )
            self._has_had_scan = True

    def _on_odometry(self, message: Odometry) -> None:
        now_ns = ns_from_stamp(message.header.stamp)
        with self._lock:
            if self._navigator is None:
                return
            try:
                self._frames.check_odometry(message.header.frame_id)
                self._navigator.take_odometry(
                    now_ns,
                    pose_from_message(message.pose.pose),
                    message.twist.twist.linear.x,
                    message.twist.twist.angular.z,
                    *twist_std_from_message(message),
                )
            except InputFault as fault:
                log.warning('%s: %s; message dropped', self._odometry.resolved_name, fault)
                return
            self._heard_ns, self._heard_at_s = now_ns, time.monotonic()
            if not self._control_rate.is_due(now_ns):
                return
            try:
                self._control(now_ns)
            except Exception:
                self._command(STOP)  # rospy logs it and goes on: not with the last command
                raise

    def _take_localization(self, now_ns: int) -> None:
        try:
            found = self._frames.odom_pose_in_map(now_ns)
            if found is not None:
                self._navigator.take_localization(*found)
        except InputFault as fault:
            log.warning('/tf: %s', fault)

    # ---- one control period

    def _control(self, now_ns: int) -> None:
        self._take_localization(now_ns)
        self._look_for_goals(now_ns)
        age_s = self._odometry_age_s()
        if age_s > self._params.input_timeout:
            self._answer(now_ns, self._wait(f'came {age_s:.1f} s late'))
        else:
            self._answer(now_ns, self._navigator.step(now_ns))

    def _on_watchdog(self, _: rospy.timer.TimerEvent) -> None:
        """Without /odom nothing else would stop the robot, or look for goals and cancels."""
        with self._lock:
            if self._navigator is None:
                if self._goals.has_new_goal:
                    log.warning('a goal waits: there is no map yet')
                return
            silent_s = time.monotonic() - self._heard_at_s
            # By both clocks: a loaded machine delays messages, and a paused simulation sends none.
            if min(silent_s, abs(self._odometry_age_s())) > self._params.input_timeout:
                now_ns = ns_from_stamp(rospy.Time.now())
                self._look_for_goals(now_ns)
                self._answer(now_ns, self._wait(f'has been silent for {silent_s:.1f} s'))

    def _look_for_goals(self, now_ns: int) -> None:
        self._goals.poll(self._navigator, now_ns)
        self._is_driving |= self._navigator.status is GoalStatus.ACTIVE

    def _odometry_age_s(self) -> float:
        return (ns_from_stamp(rospy.Time.now()) - self._heard_ns) / NANOSECONDS_PER_SECOND

    def _wait(self, why: str) -> NavigatorOutput:
        return self._navigator.wait(
            MissingInput(self._odometry.resolved_name, f'{why} (input_timeout {self._params.input_timeout:g} s)')
        )

    def _answer(self, now_ns: int, output: NavigatorOutput) -> None:
        """Tell the robot, the goal's sender and displays."""
        if output.status is GoalStatus.ACTIVE:
            self._command(output.command)
            self._goals.report(self._navigator, now_ns, output.text)
        elif self._is_driving:
            self._is_driving = False
            self._command(STOP)
            self._goals.end(output.status, output.text)
        self._views.show(self._navigator, now_ns)

    def _command(self, command: Command) -> None:
        self._commands.publish(Twist(Vector3(command.linear_mps, 0, 0), Vector3(0, 0, command.angular_radps)))

    def _on_shutdown(self) -> None:
        with self._lock:
            if self._is_driving:
                self._command(STOP)
                self._goals.end(GoalStatus.ABORTED, 'the node was shut down')
            self._navigator = None  # a message that is still on its way moves nothing

    # ---- services

    def _on_make_plan(self, request: GetPlanRequest) -> GetPlanResponse:
        with self._lock:
            if self._navigator is None:
                raise rospy.ServiceException('there is no map yet')
            try:
                start: Optional[Pose2D] = None
                if request.start.header.frame_id:
                    start = self._pose_in_map('start', request.start)
                poses = self._navigator.make_plan(start, self._pose_in_map('goal', request.goal), request.tolerance)
            except InputFault as fault:
                raise rospy.ServiceException(str(fault)) from None
            except PlanError as error:
                # As upstream: a question well put has an answer, which is no plan.
                log.warning('make_plan: %s', str(error))
                poses = np.empty((0, 3))
        return GetPlanResponse(plan=path_message(poses, ns_from_stamp(rospy.Time.now()), self._frames.map_frame))

    def _pose_in_map(self, what: str, message: PoseStamped) -> Pose2D:
        try:
            return self._frames.pose_in_map(message)
        except InputFault as fault:
            raise InputFault(f'{what}: {fault}') from None

    def _on_clear_costmaps(self, _: EmptyRequest) -> EmptyResponse:
        with self._lock:
            if self._navigator is not None:
                self._navigator.clear_costmaps()
        return EmptyResponse()


def main() -> None:
    """Entry point of the executable."""
    run_node('move_base', MoveBaseNode)
