"""The action server of move_base, and the topic move_base_simple/goal, whose poses become its goals."""

from __future__ import annotations

from typing import Callable, ContextManager, Optional

import actionlib
import numpy as np
import rospy
from geometry_msgs.msg import PoseStamped
from move_base_msgs.msg import (
    MoveBaseAction,
    MoveBaseActionGoal,
    MoveBaseFeedback,
    MoveBaseGoal,
    MoveBaseResult,
    RecoveryStatus,
)
from nav_msgs.srv import GetPlan, GetPlanRequest, GetPlanResponse
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse

from diff_encoder_sim.base.errors import EVENT, InputFault
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.navigation.global_planner import PlanError
from diff_encoder_sim.navigation.navigator import Navigator
from diff_encoder_sim.navigation.navigator_inputs import GoalStatus, NavigatorOutput
from diff_encoder_sim.ros.conversions import ns_from_stamp, pose_stamped_message
from diff_encoder_sim.ros.navigation_transforms import NavigationTransforms
from diff_encoder_sim.ros.navigation_views import path_message
from diff_encoder_sim.ros.node import log, publisher, subscriber


class GoalServer:
    """Hands goals to the navigator, and reports their feedback and results.

    It is polled once a control period: the action server calls back with its own lock held, and a callback that waited
    for the node's lock could wait for ever.
    """

    def __init__(self, transforms: NavigationTransforms) -> None:
        self._transforms = transforms
        self._current_goals = publisher('~current_goal', PoseStamped)
        self._goals = publisher('~goal', MoveBaseActionGoal)
        self._recoveries = publisher('~recovery_status', RecoveryStatus)
        self._server = actionlib.SimpleActionServer(rospy.get_name(), MoveBaseAction, auto_start=False)
        self._server.start()
        self._keep_status_up()
        self._simple_goals = subscriber('move_base_simple/goal', PoseStamped, self._on_simple_goal)

    def _keep_status_up(self) -> None:
        """Replace actionlib's timer of `~status`, which ends with an exception when time goes back."""
        server = self._server.action_server
        if server.status_frequency > 0.0:
            server.status_timer.shutdown()
            server.status_timer = rospy.Timer(
                rospy.Duration(1.0 / server.status_frequency), server.publish_status_async, reset=True
            )

    @property
    def has_new_goal(self) -> bool:
        """Whether a goal has come since the last `poll`."""
        return bool(self._server.is_new_goal_available())

    def poll(self, navigator: Navigator, now_ns: int) -> None:
        """Hand a goal that has come to the navigator, or cancel the navigator's goal if it was cancelled."""
        # In this order: a new goal asks to preempt the old one as well, after it has come.
        is_preempted = self._server.is_active() and self._server.is_preempt_requested()
        if self.has_new_goal:
            self._take_goal(navigator, now_ns)
            is_preempted = self._server.is_preempt_requested()
        if is_preempted:
            navigator.cancel()

    def _take_goal(self, navigator: Navigator, now_ns: int) -> None:
        goal: MoveBaseGoal = self._server.accept_new_goal()
        try:
            pose_in_map = self._transforms.pose_in_map(goal.target_pose)
        except InputFault as fault:
            # The goal before it has ended all the same: the action server has one at a time.
            navigator.cancel('replaced by a goal that was refused')
            log.warning('goal refused: %s', fault, extra=EVENT)
            self._server.set_aborted(MoveBaseResult(), str(fault))
            return
        navigator.set_goal(pose_in_map)
        self._current_goals.publish(pose_stamped_message(pose_in_map, now_ns, self._transforms.map_frame))

    def report(self, navigator: Navigator, now_ns: int, output: NavigatorOutput) -> None:
        """Publish feedback and a recovery that begins, and set the text of the goal's status on `~status`."""
        if not self._server.is_active():
            return
        self._server.current_goal.get_goal_status().text = output.text
        if navigator.inputs.has_pose:
            pose = pose_stamped_message(navigator.inputs.base_pose_in_map, now_ns, self._transforms.map_frame)
            self._server.publish_feedback(MoveBaseFeedback(base_position=pose))
            if output.started_recovery is not None:
                name, number, total = output.started_recovery
                self._recoveries.publish(RecoveryStatus(pose, number, total, name))

    def end(self, status: GoalStatus, text: str) -> None:
        """Publish the goal's result, unless it has one already."""
        if not self._server.is_active():
            return
        if status is GoalStatus.SUCCEEDED:
            self._server.set_succeeded(MoveBaseResult(), text)
        elif status is GoalStatus.PREEMPTED:
            self._server.set_preempted(MoveBaseResult(), text)
        else:
            log.warning('goal aborted: %s', text, extra=EVENT)
            self._server.set_aborted(MoveBaseResult(), text)

    def _on_simple_goal(self, message: PoseStamped) -> None:
        self._goals.publish(MoveBaseActionGoal(goal=MoveBaseGoal(target_pose=message)))


class PlanServices:
    """Serves `~make_plan`, `~NavfnROS/make_plan` and `~clear_costmaps`.

    Args:
        transforms: of poses to the map frame.
        lock: held while the navigator is used.
        navigator: returns it, None while there is no map.
    """

    def __init__(
        self,
        transforms: NavigationTransforms,
        lock: ContextManager[object],
        navigator: Callable[[], Optional[Navigator]],
    ) -> None:
        self._transforms, self._lock, self._navigator = transforms, lock, navigator
        self._services = [
            rospy.Service('~make_plan', GetPlan, self._on_make_plan),
            rospy.Service('~NavfnROS/make_plan', GetPlan, self._on_make_plan),
            rospy.Service('~clear_costmaps', Empty, self._on_clear_costmaps),
        ]

    def _on_make_plan(self, request: GetPlanRequest) -> GetPlanResponse:
        with self._lock:
            navigator = self._navigator()
            if navigator is None:
                raise rospy.ServiceException('there is no map yet')
            try:
                poses = self._plan(navigator, request)
            except InputFault as fault:
                raise rospy.ServiceException(str(fault)) from None
            except PlanError as error:
                # As upstream: a valid request for which there is no plan gets an empty one.
                log.warning('make_plan: %s', str(error))
                poses = np.empty((0, 3))
        return GetPlanResponse(plan=path_message(poses, ns_from_stamp(rospy.Time.now()), self._transforms.map_frame))

    def _plan(self, navigator: Navigator, request: GetPlanRequest) -> np.ndarray:
        has_start = bool(request.start.header.frame_id)
        start = self._pose_in_map('start', request.start) if has_start else None
        return navigator.make_plan(start, self._pose_in_map('goal', request.goal), request.tolerance)

    def _pose_in_map(self, what: str, message: PoseStamped) -> Pose2D:
        try:
            return self._transforms.pose_in_map(message)
        except InputFault as fault:
            raise InputFault(f'{what}: {fault}') from None

    def _on_clear_costmaps(self, _: EmptyRequest) -> EmptyResponse:
        with self._lock:
            navigator = self._navigator()
            if navigator is not None:
                navigator.clear_costmaps()
        return EmptyResponse()
