"""move_base_node: navigation with the action, topics, services and parameters of upstream move_base."""

from __future__ import annotations

import math
import time
from typing import Optional, Tuple

import actionlib
import move_base_msgs.msg as action
import numpy as np
import rospy
from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.msg import Odometry
from nav_msgs.srv import GetPlan, GetPlanRequest, GetPlanResponse
from sensor_msgs.msg import LaserScan

from diff_encoder_sim.base.errors import EVENT, InputFault
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.message_decoders import decode_scan
from diff_encoder_sim.drives.message_encoders import encode_command
from diff_encoder_sim.navigation import navigator_inputs as inputs
from diff_encoder_sim.navigation.global_planner import PlanError
from diff_encoder_sim.navigation.navigator import Navigator, warm_up
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from diff_encoder_sim.ros import messages, node
from diff_encoder_sim.ros.maps import fetch_map, grid_from_message
from diff_encoder_sim.ros.navigation_views import NavigationViews, path_message
from diff_encoder_sim.ros.reconfiguration import serve_navigation
from diff_encoder_sim.ros.transforms import NoTransform, TransformBuffer, lookup, mounted

MOST_TILT = 1e-3  # of a goal's z axis, as 1 - cos of its angle, as upstream


class NavigationTransforms:
    """Looks up the newest transforms between the frames of navigation; frame ids may begin with '/'."""

    def __init__(self, params: NavigatorParams) -> None:
        local = params.local_costmap
        self.map_frame = params.global_costmap.global_frame.lstrip('/')
        self.odom_frame = local.global_frame.lstrip('/')
        self.base_frame = local.robot_base_frame.lstrip('/')
        self.buffer = TransformBuffer()

    def odom_pose_in_map(self, now_ns: int) -> Tuple[int, Pose2D]:
        """Return (stamp_ns, pose of odom in the map); InputFault if the transform is missing or invalid."""
        transform = lookup(self.buffer, self.map_frame, self.odom_frame)
        stamp_ns = messages.ns_from_stamp(transform.header.stamp) or now_ns  # a static transform has no stamp
        if stamp_ns - now_ns > inputs.MOST_AHEAD_S * NANOSECONDS_PER_SECOND:
            self.buffer.clear()  # from before a reset of time: tf2 would keep it, and reject newer ones as too old
            raise NoTransform('from before a reset of time')
        return stamp_ns, messages.pose_from_transform(transform)

    def pose_in_map(self, message: PoseStamped) -> Pose2D:
        """Transform a goal or a start to the map; InputFault if it is not upright, or there is no transform."""
        pose, rotation = messages.pose_from_message(message.pose), message.pose.orientation
        leaning = rotation.x**2 + rotation.y**2
        if 2.0 * leaning > MOST_TILT * (leaning + rotation.z**2 + rotation.w**2):
            raise InputFault('the z axis of the pose is not upright')
        if message.header.frame_id.lstrip('/') == self.map_frame:
            return pose  # also without a transform to the map
        return messages.pose_from_transform(lookup(self.buffer, self.map_frame, message.header.frame_id)).compose(pose)


class GoalServer(actionlib.SimpleActionServer):  # type: ignore[misc]  # actionlib has no types
    """Passes goals to the navigator, and reports feedback and results.

    Goals are polled: callbacks of the action server hold its lock, so waiting for the node's lock could deadlock.
    """

    def __init__(self, transforms: NavigationTransforms) -> None:
        super().__init__(rospy.get_name(), action.MoveBaseAction, auto_start=False)
        self._transforms = transforms
        self._current_goals = messages.Publisher('~current_goal', PoseStamped)
        self._goals = messages.Publisher('~goal', action.MoveBaseActionGoal)
        self._recoveries = messages.Publisher('~recovery_status', action.RecoveryStatus)
        self.start()
        server = self.action_server  # its `~status` timer raises an exception if time goes back
        server.status_timer.shutdown()
        period = rospy.Duration(1.0 / server.status_frequency)
        server.status_timer = rospy.Timer(period, server.publish_status_async, reset=True)
        messages.subscriber('move_base_simple/goal', PoseStamped, self._on_simple_goal)

    def poll(self, navigator: Navigator, now_ns: int) -> None:
        """Pass a new goal to the navigator, or cancel its goal."""
        # In this order: a new goal, which may arrive at any moment, also preempts the previous one.
        is_preempted = self.is_active() and self.is_preempt_requested()
        if self.is_new_goal_available():
            try:
                pose_in_map = self._transforms.pose_in_map(self.accept_new_goal().target_pose)
            except InputFault as fault:
                navigator.cancel('replaced by a goal that was refused')  # as the action server has done
                node.log.warning('goal refused: %s', fault, extra=EVENT)
                self.set_aborted(text=str(fault))
                return
            navigator.set_goal(pose_in_map)
            self._current_goals.publish(self._stamped(pose_in_map, now_ns))
            is_preempted = self.is_preempt_requested()
        if is_preempted:
            navigator.cancel()

    def report(self, navigator: Navigator, now_ns: int, output: inputs.NavigatorOutput) -> None:
        """Publish feedback and new recoveries, and set the text of the goal on `~status`."""
        if not self.is_active():
            return
        self.current_goal.get_goal_status().text = output.text
        if navigator.has_pose:
            pose = self._stamped(navigator.base_pose_in_map, now_ns)
            self.publish_feedback(action.MoveBaseFeedback(base_position=pose))
            if output.started_recovery is not None:
                name, number, total = output.started_recovery
                self._recoveries.publish(action.RecoveryStatus(pose, number, total, name))

    def end(self, status: inputs.GoalStatus, text: str) -> None:
        """Publish the result of the goal, unless it has one."""
        if not self.is_active():
            return
        if status is inputs.GoalStatus.SUCCEEDED:
            self.set_succeeded(text=text)
        elif status is inputs.GoalStatus.PREEMPTED:
            self.set_preempted(text=text)
        else:
            node.log.warning('goal aborted: %s', text, extra=EVENT)
            self.set_aborted(text=text)

    def _stamped(self, pose_in_map: Pose2D, now_ns: int) -> PoseStamped:
        return messages.pose_stamped_message(pose_in_map, now_ns, self._transforms.map_frame)

    def _on_simple_goal(self, message: PoseStamped) -> None:
        self._goals.publish(action.MoveBaseActionGoal(goal=action.MoveBaseGoal(target_pose=message)))


class MoveBaseNode:
    """Steps the navigator with /odom at controller_frequency, and publishes its output."""

    def __init__(self) -> None:
        self._params = node.node_params(NavigatorParams, part='navigation')
        node.compile_first(warm_up)
        self._navigator: Optional[Navigator] = None
        self._is_driving = self._has_had_scan = False
        self._odometry_ns, self._odometry_at_s = 0, time.monotonic()  # stamp and arrival of the latest valid message
        self._control_rate = inputs.ControlRate(self._params.controller_frequency)
        self._commands = messages.Publisher('cmd_vel', Twist)
        self._transforms = NavigationTransforms(self._params)
        self._views = NavigationViews(self._transforms.map_frame, self._transforms.odom_frame)
        self._goals = GoalServer(self._transforms)
        node.service('~make_plan', GetPlan, self._on_make_plan)
        node.service('~NavfnROS/make_plan', GetPlan, self._on_make_plan)
        node.empty_service('~clear_costmaps', self._on_clear_costmaps)
        self._scans = messages.encoded_subscriber('scan', LaserScan, self._on_scan)
        self._odometry = messages.encoded_subscriber('odom', Odometry, self._on_odometry)
        node.timer(0.1, self._on_watchdog)
        rospy.on_shutdown(node.one_at_a_time(self._on_shutdown))
        fetch_map(self._on_map)
        serve_navigation(self._params, self._reconfigure)

    def _reconfigure(self, params: NavigatorParams) -> None:
        if self._navigator is not None:
            self._navigator.reconfigure(params)
        if params.controller_frequency != self._params.controller_frequency:
            self._control_rate = inputs.ControlRate(params.controller_frequency)
        self._params = params

    def _on_map(self, message: OccupancyGridMessage) -> None:
        try:
            self._navigator = Navigator(self._params, grid_from_message(message))
        except InputFault as fault:
            node.log.warning('map not used: %s', fault)

    def _on_scan(self, content: bytes) -> None:
        if self._navigator is None:
            return
        is_first, self._has_had_scan = not self._has_had_scan, True
        scan, frame = decode_scan(content)
        try:
            transform = lookup(self._transforms.buffer, self._transforms.base_frame, frame)
        except NoTransform as fault:
            if not is_first:
                raise
            # robot_state_publisher publishes the laser's transform only when simulated time runs.
            node.log.info('%s: first scan not used: %s', self._scans.resolved_name, fault)
        else:
            scan, laser_pose_in_base, _ = mounted(scan, transform)
            self._navigator.take_scan(scan, laser_pose_in_base)

    def _on_odometry(self, content: bytes) -> None:
        message = Odometry().deserialize(content)
        now_ns, navigator = messages.ns_from_stamp(message.header.stamp), self._navigator
        node.look_at_clock()  # for the age of the next message
        if navigator is None:
            self._control_rate.is_due(now_ns)  # starts at the first message, as in simulator_node
            return
        frame, expected = message.header.frame_id, self._transforms.odom_frame
        if frame.lstrip('/') not in ('', expected):
            raise InputFault(f'header.frame_id is {frame!r}; expected {expected!r} (local_costmap/global_frame)')
        twist, variances = message.twist.twist, message.twist.covariance
        stds = (math.sqrt(max(variances[index], 0.0)) for index in (0, 35))  # negative variances are unknown
        motion = messages.pose_from_message(message.pose.pose), twist.linear.x, twist.angular.z
        navigator.take_odometry(inputs.OdometrySample(now_ns, *motion, *stds))
        self._odometry_ns, self._odometry_at_s = now_ns, time.monotonic()
        if not self._control_rate.is_due(now_ns):
            return
        try:
            self._control(navigator, now_ns)
        except Exception:
            self._command(inputs.STOP)  # rospy logs the exception and continues
            raise

    def _control(self, navigator: Navigator, now_ns: int) -> None:
        try:
            navigator.take_localization(*self._transforms.odom_pose_in_map(now_ns))
        except NoTransform:
            pass  # the navigator reports it
        except InputFault as fault:
            node.log.warning('/tf: transform map -> odom: %s; not used', fault)
        age_s = self._odometry_age_s()
        self._act(navigator, now_ns, f'arrived {age_s:.1f} s late' if age_s > self._params.input_timeout else '')

    def _on_watchdog(self) -> None:
        """Stop the robot, and poll goals and cancels, without /odom."""
        navigator = self._navigator
        if navigator is None:
            if self._goals.is_new_goal_available():
                node.log.warning('goal received before the map (service static_map); waiting')
            return
        silent_s = time.monotonic() - self._odometry_at_s
        # Check both clocks: a loaded host delays messages, and a paused simulation sends none.
        if min(silent_s, abs(self._odometry_age_s())) > self._params.input_timeout:
            self._act(navigator, messages.clock_ns(), f'has not been received for {silent_s:.1f} s')

    def _odometry_age_s(self) -> float:
        return (messages.clock_ns() - self._odometry_ns) / NANOSECONDS_PER_SECOND

    def _act(self, navigator: Navigator, now_ns: int, fault: str) -> None:
        """Poll goals, step the navigator or let it wait due to a fault of odometry, and publish its output."""
        self._goals.poll(navigator, now_ns)
        self._is_driving |= navigator.status is inputs.GoalStatus.ACTIVE
        if fault:
            text = f'{fault} (input_timeout {self._params.input_timeout:g} s)'
            output = navigator.wait(inputs.MissingInput(self._odometry.resolved_name, text))
        else:
            output = navigator.step(now_ns)
        if output.status is inputs.GoalStatus.ACTIVE:
            self._command(output.command)
            self._goals.report(navigator, now_ns, output)
        elif self._is_driving:
            self._end(output.status, output.text)
        self._views.show(navigator, now_ns)

    def _end(self, status: inputs.GoalStatus, text: str) -> None:
        self._is_driving = False
        self._command(inputs.STOP)
        self._goals.end(status, text)

    def _command(self, command: inputs.Command) -> None:
        self._commands.publish(encode_command(*command))

    def _on_shutdown(self) -> None:
        if self._is_driving:
            self._end(inputs.GoalStatus.ABORTED, 'move_base was shut down')
        self._navigator = None  # ignore further messages

    def _on_make_plan(self, request: GetPlanRequest) -> GetPlanResponse:
        if self._navigator is None:
            raise rospy.ServiceException('there is no map yet')
        try:
            start = self._transforms.pose_in_map(request.start) if request.start.header.frame_id else None
            poses = self._navigator.make_plan(start, self._transforms.pose_in_map(request.goal), request.tolerance)
        except InputFault as fault:
            raise rospy.ServiceException(str(fault)) from None
        except PlanError as error:
            node.log.warning('make_plan: %s', str(error))
            poses = np.empty((0, 3))  # as upstream
        place = messages.header(messages.clock_ns(), self._transforms.map_frame)
        return GetPlanResponse(plan=path_message(poses, place))

    def _on_clear_costmaps(self) -> None:
        if self._navigator is not None:
            self._navigator.clear_costmaps()


main = node.executable('move_base', MoveBaseNode)
