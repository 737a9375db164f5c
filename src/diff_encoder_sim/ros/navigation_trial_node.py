"""navigation_trial_node: sends a test's route to move_base, leg by leg, and ends with the trial."""
from __future__ import annotations

import math
import threading
from typing import Optional

import actionlib
from actionlib_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseStamped, Twist, Vector3
from move_base_msgs.msg import MoveBaseAction, MoveBaseGoal

from diff_encoder_sim.errors import InputFault
from diff_encoder_sim.experiments.definition import Leg, SpeedLimits
from diff_encoder_sim.experiments.turning import TurnInPlace
from diff_encoder_sim.recording import topics
from diff_encoder_sim.ros.conversions import ns_from_stamp, pose_from_message, pose_stamped_message
from diff_encoder_sim.ros.launch_status import LaunchStatus
from diff_encoder_sim.ros.node import log, node_params, publisher, run_node, subscriber
from diff_encoder_sim.ros.trial_runner import TrialFailed, TrialParams, TrialRunner
from diff_encoder_sim.se2 import Pose2D

ACTION = 'move_base'


class NavigationTrialNode:
    """Drives by goals. Where it is, it knows from /global_pose, as the robot does."""

    def __init__(self, status: LaunchStatus) -> None:
        self._params = node_params(TrialParams)
        self._believed: Optional[Pose2D] = None
        self._now_ns = 0
        self._turn: Optional[TurnInPlace] = None
        self._turned = threading.Event()
        self._runner = TrialRunner(status, self._params, lambda stamp_ns, pose: None)
        self._commands = publisher('cmd_vel', Twist)
        self._action = actionlib.SimpleActionClient(ACTION, MoveBaseAction)
        self._global_pose = subscriber(topics.GLOBAL_POSE, PoseStamped, self._on_global_pose)

    def run(self) -> None:
        """Blocks until the trial is over."""
        self._runner.run(self._drive, ('/scan', '/amcl_pose', '/map', f'/{ACTION}/status'))

    def _drive(self) -> None:
        self._runner.wait_for(lambda: self._believed is not None)
        for leg in self._runner.trial.test.route:
            self._drive_leg(leg)

    def _drive_leg(self, leg: Leg) -> None:
        if leg.turns is not None:
            self._turn_in_place(leg.turns, self._runner.trial.test.limits)
        elif leg.through is not None:
            points = [(point.x, point.y) for point in leg.through]
            for index, point in enumerate(points):
                ahead = points[min(index + 1, len(points) - 1)]
                self._pass(Pose2D(*point, math.atan2(ahead[1] - point[1], ahead[0] - point[0])))
        elif leg.goal is not None:
            self._send(leg.goal.pose())
            self._runner.wait_for(self._has_ended)
            self._check_reached('the goal')

    def _pass(self, waypoint: Pose2D) -> None:
        """Go on as soon as the waypoint is near: a new goal takes the place of this one."""
        self._send(waypoint)
        self._runner.wait_for(lambda: self._is_near(waypoint) or self._has_ended())
        if not self._is_near(waypoint):
            self._check_reached(f'the waypoint ({waypoint.x_m:.2f}, {waypoint.y_m:.2f})')

    def _send(self, pose: Pose2D) -> None:
        self._action.send_goal(MoveBaseGoal(target_pose=pose_stamped_message(
            pose, self._now_ns, self._params.map_frame)))

    def _has_ended(self) -> bool:
        return self._action.get_state() not in (GoalStatus.PENDING, GoalStatus.ACTIVE)

    def _is_near(self, waypoint: Pose2D) -> bool:
        return math.hypot(self._believed.x_m - waypoint.x_m, self._believed.y_m - waypoint.y_m
                          ) <= self._runner.trial.test.pass_radius

    def _check_reached(self, what: str) -> None:
        if self._action.get_state() != GoalStatus.SUCCEEDED:
            raise TrialFailed(f'{what} was not reached: '
                              f'{self._action.get_goal_status_text() or "given up"}')

    def _turn_in_place(self, turns: float, limits: SpeedLimits) -> None:
        self._turned.clear()
        self._turn = TurnInPlace(2.0 * math.pi * turns, limits)
        self._runner.wait_for(self._turned.is_set)

    def _on_global_pose(self, message: PoseStamped) -> None:
        try:
            self._believed = pose_from_message(message.pose)
        except InputFault as fault:
            log.warning('%s: %s; message dropped', topics.GLOBAL_POSE, fault)
            return
        self._now_ns = ns_from_stamp(message.header.stamp)
        if self._turn is not None:
            rate_radps = self._turn.rate(self._now_ns, self._believed.yaw_rad)
            self._commands.publish(Twist(Vector3(), Vector3(0, 0, rate_radps)))
            if self._turn.is_over:
                self._turn = None
                self._turned.set()


def main() -> None:
    """Entry point of the executable."""
    # First of all, so that whatever goes wrong from here on fails the launch.
    status = LaunchStatus()
    run_node('navigation_trial_node', lambda: NavigationTrialNode(status),
             NavigationTrialNode.run)
