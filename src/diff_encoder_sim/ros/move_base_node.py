"""move_base_node: navigation on upstream move_base's action, topics, services and parameters."""

from __future__ import annotations

import threading
import time
from typing import Optional

import rospy
from geometry_msgs.msg import Twist, Vector3
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.msg import Odometry
from sensor_msgs.msg import LaserScan

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.navigation.navigator import Navigator, warm_up
from diff_encoder_sim.navigation.navigator_inputs import (
    STOP,
    Command,
    ControlRate,
    GoalStatus,
    MissingInput,
    NavigatorOutput,
)
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from diff_encoder_sim.ros.clock_pauses import look_at_clock
from diff_encoder_sim.ros.conversions import ns_from_stamp, pose_from_message, scan_from_message, twist_std_from_message
from diff_encoder_sim.ros.encoded_topics import stamped_subscriber
from diff_encoder_sim.ros.goal_server import GoalServer, PlanServices
from diff_encoder_sim.ros.maps import fetch_map, grid_from_message
from diff_encoder_sim.ros.navigation_transforms import NavigationTransforms
from diff_encoder_sim.ros.navigation_views import NavigationViews
from diff_encoder_sim.ros.node import compile_first, log, node_params, publisher, run_node
from diff_encoder_sim.ros.reconfiguration import serve_navigation

WATCHDOG_PERIOD_S = 0.1


class MoveBaseNode:
    """Steps the navigator with /odom at controller_frequency, and publishes what comes of it."""

    def __init__(self) -> None:
        self._params = node_params(NavigatorParams, part='navigation')
        compile_first(warm_up)
        self._lock = threading.RLock()  # topics, services and the map come in threads
        self._navigator: Optional[Navigator] = None
        self._is_driving = self._has_had_scan = False
        self._odometry_ns, self._odometry_at_s = 0, time.monotonic()  # the newest good one: its stamp, its arrival
        self._control_rate = ControlRate(self._params.controller_frequency)
        self._commands = publisher('cmd_vel', Twist)
        self._transforms = _transforms(self._params)
        self._views = NavigationViews(self._transforms.map_frame, self._transforms.odom_frame)
        self._goals = GoalServer(self._transforms)
        self._services = PlanServices(self._transforms, self._lock, lambda: self._navigator)
        self._scans = stamped_subscriber('scan', LaserScan, self._on_scan)
        self._odometry = stamped_subscriber('odom', Odometry, self._on_odometry)
        self._watchdog = rospy.Timer(rospy.Duration(WATCHDOG_PERIOD_S), self._on_watchdog, reset=True)
        rospy.on_shutdown(self._on_shutdown)
        fetch_map(self._on_map)
        self._reconfiguration = serve_navigation(self._params, self._reconfigure)

    def _reconfigure(self, params: NavigatorParams) -> None:
        with self._lock:
            if self._navigator is not None:
                self._navigator.reconfigure(params)
            if params.controller_frequency != self._params.controller_frequency:
                self._control_rate = ControlRate(params.controller_frequency)
            self._params = params

    # ---- arrivals

    def _on_map(self, message: OccupancyGridMessage) -> None:
        with self._lock:
            try:
                self._navigator = Navigator(self._params, grid_from_message(message))
            except InputFault as fault:
                log.warning('map not used: %s', fault)

    def _on_scan(self, message: LaserScan) -> None:
        with self._lock:
            if self._navigator is None:
                return
            try:
                mount = self._transforms.laser_mount(message.header.frame_id)
                self._navigator.take_scan(mount.level(scan_from_message(message)), mount.laser_pose_in_base)
            except InputFault as fault:
                # robot_state_publisher publishes the laser's transform only once simulated time runs.
                if self._has_had_scan:
                    log.warning('%s: %s; scan dropped', self._scans.resolved_name, fault)
                else:
                    log.info('%s: first scan not used: %s', self._scans.resolved_name, fault)
            self._has_had_scan = True

    def _on_odometry(self, message: Odometry) -> None:
        now_ns = ns_from_stamp(message.header.stamp)
        look_at_clock()  # by which the age of the next one is told
        with self._lock:
            navigator = self._navigator
            if navigator is None:
                self._control_rate.is_due(now_ns)  # from the first message on, as simulator_node counts
                return
            try:
                self._take_odometry(navigator, now_ns, message)
            except InputFault as fault:
                log.warning('%s: %s; message dropped', self._odometry.resolved_name, fault)
                return
            self._odometry_ns, self._odometry_at_s = now_ns, time.monotonic()
            if not self._control_rate.is_due(now_ns):
                return
            try:
                self._control(navigator, now_ns)
            except Exception:
                self._command(STOP)  # rospy logs the exception and goes on: not with the last command
                raise

    def _take_odometry(self, navigator: Navigator, now_ns: int, message: Odometry) -> None:
        self._transforms.check_odometry(message.header.frame_id)
        navigator.take_odometry(
            now_ns,
            pose_from_message(message.pose.pose),
            message.twist.twist.linear.x,
            message.twist.twist.angular.z,
            *twist_std_from_message(message),
        )

    def _take_localization(self, navigator: Navigator, now_ns: int) -> None:
        try:
            found = self._transforms.odom_pose_in_map(now_ns)
            if found is not None:
                navigator.take_localization(*found)
        except InputFault as fault:
            log.warning('/tf: transform map -> odom: %s; not used', fault)

    # ---- one control period

    def _control(self, navigator: Navigator, now_ns: int) -> None:
        self._take_localization(navigator, now_ns)
        self._poll_goals(navigator, now_ns)
        age_s = self._odometry_age_s()
        if age_s > self._params.input_timeout:
            self._apply(navigator, now_ns, self._wait(navigator, f'arrived {age_s:.1f} s late'))
        else:
            self._apply(navigator, now_ns, navigator.step(now_ns))

    def _on_watchdog(self, _: rospy.timer.TimerEvent) -> None:
        """Stop the robot, and poll goals and cancels, while no /odom does."""
        with self._lock:
            navigator = self._navigator
            if navigator is None:
                if self._goals.has_new_goal:
                    log.warning('a goal has come, but no map yet (service static_map): the goal waits for it')
                return
            silent_s = time.monotonic() - self._odometry_at_s
            # By both clocks: a loaded host delays messages, and a paused simulation sends none.
            if min(silent_s, abs(self._odometry_age_s())) > self._params.input_timeout:
                now_ns = ns_from_stamp(rospy.Time.now())
                self._poll_goals(navigator, now_ns)
                self._apply(navigator, now_ns, self._wait(navigator, f'has not been received for {silent_s:.1f} s'))

    def _poll_goals(self, navigator: Navigator, now_ns: int) -> None:
        self._goals.poll(navigator, now_ns)
        self._is_driving |= navigator.status is GoalStatus.ACTIVE

    def _odometry_age_s(self) -> float:
        return (ns_from_stamp(rospy.Time.now()) - self._odometry_ns) / NANOSECONDS_PER_SECOND

    def _wait(self, navigator: Navigator, why: str) -> NavigatorOutput:
        limit = f'(input_timeout {self._params.input_timeout:g} s)'
        return navigator.wait(MissingInput(self._odometry.resolved_name, f'{why} {limit}'))

    def _apply(self, navigator: Navigator, now_ns: int, output: NavigatorOutput) -> None:
        """Publish the command, the goal's state and what displays show."""
        if output.status is GoalStatus.ACTIVE:
            self._command(output.command)
            self._goals.report(navigator, now_ns, output)
        elif self._is_driving:
            self._is_driving = False
            self._command(STOP)
            self._goals.end(output.status, output.text)
        self._views.show(navigator, now_ns)

    def _command(self, command: Command) -> None:
        self._commands.publish(Twist(Vector3(command.linear_mps, 0, 0), Vector3(0, 0, command.angular_radps)))

    def _on_shutdown(self) -> None:
        with self._lock:
            if self._is_driving:
                self._command(STOP)
                self._goals.end(GoalStatus.ABORTED, 'move_base was shut down')
            self._navigator = None  # a message that is still on its way moves nothing


def _transforms(params: NavigatorParams) -> NavigationTransforms:
    local = params.local_costmap
    return NavigationTransforms(params.global_costmap.global_frame, local.global_frame, local.robot_base_frame)


def main() -> None:
    """Run the node."""
    run_node('move_base', MoveBaseNode)
