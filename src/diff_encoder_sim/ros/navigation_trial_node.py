"""navigation_trial_node: sends a test's route to move_base, goal by goal, and ends with the trial."""

from __future__ import annotations

import threading
from typing import Callable, Optional, Tuple

import actionlib
import rospy
from actionlib_msgs.msg import GoalStatus as ActionStatus
from geometry_msgs.msg import Twist, Vector3
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives import topics
from diff_encoder_sim.drives.trial_definition import RouteFailed
from diff_encoder_sim.navigation.navigator_inputs import GoalStatus
from diff_encoder_sim.ros.conversions import pose_stamped_message
from diff_encoder_sim.ros.encoded_topics import pose_subscriber
from diff_encoder_sim.ros.launch_status import LaunchStatus
from diff_encoder_sim.ros.node import log, node_params, publisher, run_node
from diff_encoder_sim.ros.trial_runner import TrialFailed, TrialParams, TrialRunner, distance_from_goal
from diff_encoder_sim.trials.route_driver import DriverOutput, RouteDriver

ACTION = 'move_base'

_STATUS = {
    ActionStatus.PENDING: GoalStatus.ACTIVE,
    ActionStatus.ACTIVE: GoalStatus.ACTIVE,
    ActionStatus.PREEMPTING: GoalStatus.ACTIVE,
    ActionStatus.RECALLING: GoalStatus.ACTIVE,
    ActionStatus.SUCCEEDED: GoalStatus.SUCCEEDED,
    ActionStatus.PREEMPTED: GoalStatus.PREEMPTED,
}


class NavigationTrialNode:
    """Steps the route's driver with each /global_pose, and applies its goals and turns."""

    def __init__(self, status: LaunchStatus) -> None:
        self._params = node_params(TrialParams)
        self._runner = TrialRunner(status, self._params, self._watch)
        self._driver = RouteDriver(self._runner.trial.test)
        self._estimate: Optional[Pose2D] = None
        self._failure: Optional[RouteFailed] = None
        self._goal: Optional[actionlib.ClientGoalHandle] = None
        self._lock = threading.Lock()  # true and estimated poses come in threads
        self._may_drive, self._ended = threading.Event(), threading.Event()
        self._commands = publisher('cmd_vel', Twist)
        # Not SimpleActionClient: it may receive a status of a goal before it knows the goal, and logs an error.
        self._action = actionlib.ActionClient(ACTION, MoveBaseAction)
        self._global_pose = pose_subscriber(topics.GLOBAL_POSE, self._on_global_pose)

    def run(self) -> None:
        """Run the trial; returns at its end."""
        connected = ['/scan', '/amcl_pose', '/map']
        if self._runner.trial.nav != 'upstream':
            connected += [f'/{ACTION}/status', '/amcl/scan_taken']
            self._may_drive.set()
        self._runner.run(self._drive, connected)

    def _drive(self) -> None:
        if not self._may_drive.is_set():
            # Upstream's move_base offers its action only when time runs and AMCL localizes.
            self._runner.wait_for(self._is_served)
            self._may_drive.set()
        self._runner.wait_for(self._ended.is_set)
        if self._failure is not None:
            self._action.cancel_all_goals()
            self._commands.publish(Twist())  # ends a turn in place, which is not move_base's
            outcome, reason = self._failure.ending
            raise TrialFailed(reason, outcome)
        if self._estimate is not None:
            distance = distance_from_goal(self._estimate, self._runner.trial.goal())
            log.info('estimated pose (%s): %s', topics.GLOBAL_POSE, distance)

    def _is_served(self) -> bool:
        # It would wait by simulated time, which may stand still. With a limit a second ago it only looks once.
        a_second = rospy.Duration(1.0)
        return rospy.Time.now() >= rospy.Time() + a_second and bool(self._action.wait_for_server(-a_second))

    def _watch(self, stamp_ns: int, _: Pose2D) -> None:
        """Let the driver check its time limits also while there is no pose estimate."""
        self._drive_on(stamp_ns, lambda: self._driver.watch(stamp_ns))

    def _on_global_pose(self, stamp_ns: int, base_pose_in_map: Pose2D) -> None:
        if self._ended.is_set() or not self._may_drive.is_set():
            return
        self._estimate = base_pose_in_map
        self._drive_on(stamp_ns, lambda: self._driver.step(stamp_ns, base_pose_in_map, *self._goal_status()))

    def _drive_on(self, stamp_ns: int, decide: Callable[[], DriverOutput]) -> None:
        with self._lock:
            if self._ended.is_set():
                return
            try:
                self._apply(stamp_ns, decide())
            except RouteFailed as failure:
                self._failure = failure
            if self._failure is not None or self._driver.is_over:
                self._ended.set()

    def _goal_status(self) -> Tuple[GoalStatus, str]:
        if self._goal is None:
            return GoalStatus.NONE, ''
        return (_STATUS.get(self._goal.get_goal_status(), GoalStatus.ABORTED), self._goal.get_goal_status_text())

    def _apply(self, stamp_ns: int, output: DriverOutput) -> None:
        if output.turn_rate_radps is not None:
            self._commands.publish(Twist(Vector3(), Vector3(0, 0, output.turn_rate_radps)))
        if output.goal_in_map is not None:
            self._goal = self._action.send_goal(
                MoveBaseGoal(target_pose=pose_stamped_message(output.goal_in_map, stamp_ns, self._params.map_frame))
            )


def main(status: LaunchStatus) -> None:
    """Run the node."""
    run_node('navigation_trial_node', lambda: NavigationTrialNode(status), NavigationTrialNode.run)
