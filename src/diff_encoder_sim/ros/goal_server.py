"""The action server of move_base, and the topic move_base_simple/goal, whose poses become its goals."""

from __future__ import annotations

import actionlib
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

from diff_encoder_sim.base.errors import EVENT, InputFault
from diff_encoder_sim.navigation.goal_status import GoalStatus, NavigatorOutput
from diff_encoder_sim.navigation.navigator import Navigator
from diff_encoder_sim.ros.conversions import pose_stamped_message
from diff_encoder_sim.ros.navigation_transforms import NavigationTransforms
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
