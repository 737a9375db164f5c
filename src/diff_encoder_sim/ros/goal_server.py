"""The action move_base as a server, and the topic move_base_simple/goal that leads to it."""

from __future__ import annotations

import actionlib
import rospy
from geometry_msgs.msg import PoseStamped
from move_base_msgs.msg import MoveBaseAction, MoveBaseActionGoal, MoveBaseFeedback, MoveBaseGoal, MoveBaseResult

from diff_encoder_sim.base.errors import EVENT, InputFault
from diff_encoder_sim.navigation.goal_status import GoalStatus
from diff_encoder_sim.navigation.navigator import Navigator
from diff_encoder_sim.ros.conversions import pose_stamped_message
from diff_encoder_sim.ros.node import log, publisher, subscriber
from diff_encoder_sim.ros.tf_frames import RobotFrames


class GoalServer:
    """Hands goals to the navigator, and what becomes of them back.

    It is asked once a control period: the action server calls back with its own lock held, and
    who waited there for the node's lock might wait for ever.
    """

    def __init__(self, frames: RobotFrames) -> None:
        self._frames = frames
        self._current_goals = publisher('~current_goal', PoseStamped)
        self._goals = publisher('~goal', MoveBaseActionGoal)
        self._server = actionlib.SimpleActionServer(rospy.get_name(), MoveBaseAction, auto_start=False)
        self._server.start()
        self._keep_status_up()
        self._simple_goals = subscriber('move_base_simple/goal', PoseStamped, self._on_simple_goal)

    def _keep_status_up(self) -> None:
        """Actionlib's own timer of `~status` ends with an exception where time goes back."""
        server = self._server.action_server
        if server.status_frequency > 0.0:
            server.status_timer.shutdown()
            server.status_timer = rospy.Timer(
                rospy.Duration(1.0 / server.status_frequency), server.publish_status_async, reset=True
            )

    @property
    def has_new_goal(self) -> bool:
        """Whether a goal waits for `poll`."""
        return self._server.is_new_goal_available()

    def poll(self, navigator: Navigator, now_ns: int) -> None:
        """Tell the navigator of a goal that has come, or that its goal is cancelled."""
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
            pose_in_map = self._frames.pose_in_map(goal.target_pose)
        except InputFault as fault:
            # The goal before it is over all the same: the action server knows one at a time.
            navigator.cancel('replaced by a goal that was refused')
            log.warning('goal: %s; refused', fault, extra=EVENT)
            self._server.set_aborted(MoveBaseResult(), str(fault))
            return
        navigator.set_goal(pose_in_map)
        self._current_goals.publish(pose_stamped_message(pose_in_map, now_ns, self._frames.map_frame))

    def report(self, navigator: Navigator, now_ns: int, text: str) -> None:
        """Feedback, and the text of the goal's status on `~status`."""
        if not self._server.is_active():
            return
        self._server.current_goal.get_goal_status().text = text
        if navigator.inputs.has_pose:
            self._server.publish_feedback(
                MoveBaseFeedback(
                    base_position=pose_stamped_message(
                        navigator.inputs.base_pose_in_map, now_ns, self._frames.map_frame
                    )
                )
            )

    def end(self, status: GoalStatus, text: str) -> None:
        """The result of the goal, unless it is over already."""
        if not self._server.is_active():
            return
        if status is GoalStatus.SUCCEEDED:
            self._server.set_succeeded(MoveBaseResult(), text)
        elif status is GoalStatus.PREEMPTED:
            self._server.set_preempted(MoveBaseResult(), text)
        else:
            log.warning('goal given up: %s', text, extra=EVENT)
            self._server.set_aborted(MoveBaseResult(), text)

    def _on_simple_goal(self, message: PoseStamped) -> None:
        self._goals.publish(MoveBaseActionGoal(goal=MoveBaseGoal(target_pose=message)))
