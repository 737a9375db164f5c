"""One goal from plan to end: move_base's executeCycle, with its three states and its patience."""

from __future__ import annotations

import logging
import math
from typing import List, NamedTuple, Optional

import numpy as np

from diff_encoder_sim.base.errors import EVENT
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.global_planner import GlobalPlanner, PlanError
from diff_encoder_sim.navigation.goal_stopping import Motion
from diff_encoder_sim.navigation.local_planner import LocalPlanner
from diff_encoder_sim.navigation.navigator_inputs import (
    STOP,
    Command,
    GoalStatus,
    MissingInput,
    NavigatorInputs,
    Phase,
    StartedRecovery,
    Trigger,
)
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from diff_encoder_sim.navigation.recovery import Recovery, RecoverySequence, RecoveryView, TravelWatch

log = logging.getLogger(__name__)

# Without a planner_frequency a failed plan is retried as often as costmaps change. Upstream's thread retries without
# a pause.
PLAN_RETRY_S = 0.2

DRIVING = 'driving to the goal'


class NavigatorParts(NamedTuple):
    """Parts of the navigator that a run uses and that outlive it."""

    params: NavigatorParams
    inputs: NavigatorInputs
    global_costmap: Costmap
    local_costmap: Costmap
    global_planner: GlobalPlanner
    local_planner: LocalPlanner
    recoveries: List[Recovery]
    travel_watch: TravelWatch


class GoalRun:
    """Drives to one goal until it is reached, given up or cancelled.

    Args:
        parts: of the navigator.
        goal: in the map frame.
        command: the command in force, of the run before this one.
    """

    def __init__(self, parts: NavigatorParts, goal: Pose2D, command: Command = STOP) -> None:
        self._parts, self._params, self._goal = parts, parts.params, goal
        self.status, self.phase, self.text = GoalStatus.ACTIVE, Phase.PLANNING, ''
        self.global_plan_in_map = np.empty((0, 3))
        self.local_plan_in_odom = np.empty((0, 3))
        self.command = command  # the last one returned
        self.started_recovery: Optional[StartedRecovery] = None  # in this period
        self._is_under_way = False  # False before the first step and while waiting
        self._waits_for: Optional[MissingInput] = None
        self._recovery = RecoverySequence(parts.recoveries)
        self._planning_retries = 0
        self._progress_pose: Optional[Pose2D] = None
        self._planned_ns: Optional[int] = None  # time of the last attempt, successful or not
        self._last_plan_ns = self._last_control_ns = self._last_progress_ns = 0

    def reconfigure(self, parts: NavigatorParts) -> None:
        """Go on with other parts, along the same plan; recovery behaviours begin anew."""
        if parts.local_planner is not self._parts.local_planner and len(self.global_plan_in_map):
            parts.local_planner.set_plan(self.global_plan_in_map)
        self._parts, self._params = parts, parts.params
        self._recovery = RecoverySequence(parts.recoveries)

    def wait(self, missing: MissingInput) -> None:
        """Stop because an input is missing; the next `act` continues with full patience and a new plan."""
        if self._waits_for is None:
            log.warning('%s; robot stopped', missing, extra=EVENT)
        self.command, self._waits_for, self._is_under_way = STOP, missing, False
        self.started_recovery = None
        self.text = f'stopped: {missing}'

    def end(self, status: GoalStatus, text: str) -> None:
        """End the run with a status and its reason."""
        self.status, self.text = status, text
        self.local_plan_in_odom = np.empty((0, 3))

    def act(self, now_ns: int) -> Command:
        """Return the command for one control period."""
        if not self._is_under_way:
            self._set_out(now_ns)
        self.started_recovery = None
        self._watch_travel(now_ns)
        self.command = self._act(now_ns) if self.status is GoalStatus.ACTIVE else STOP
        return self.command

    def _set_out(self, now_ns: int) -> None:
        if self._waits_for is not None:
            log.info('%s received again: driving on with a new plan', self._waits_for.what, extra=EVENT)
        self._is_under_way, self._waits_for = True, None
        self._last_control_ns = now_ns
        self._go_to_planning(now_ns)

    def _act(self, now_ns: int) -> Command:
        self._watch_progress(now_ns)
        if self.phase is Phase.CONTROLLING:
            self._replan_if_due(now_ns)
        if self.phase is Phase.PLANNING:
            self._plan(now_ns)
        if self.status is GoalStatus.ACTIVE and self.phase is Phase.CONTROLLING:
            return self._control(now_ns)
        if self.status is GoalStatus.ACTIVE and self.phase is Phase.CLEARING:
            return self._recover(now_ns)
        return STOP

    # ---- planning

    def _plan(self, now_ns: int) -> None:
        """Make a plan; go on to control, or to recovery when patience is over."""
        if self._planned_ns is not None and not self._is_plan_due(now_ns, PLAN_RETRY_S):
            return
        try:
            self._make_plan(now_ns)
        except PlanError as error:
            self._planning_failed(now_ns, error)
            return
        self._recovery.restart_after(Trigger.PLANNING)
        self.phase = Phase.CONTROLLING

    def _planning_failed(self, now_ns: int, error: PlanError) -> None:
        self.text = str(error)
        self._planning_retries += 1
        is_patience_over = _is_over(self._last_plan_ns, self._params.planner_patience, now_ns)
        if error.problem.is_lasting:
            self.end(GoalStatus.ABORTED, str(error))
        elif is_patience_over or 0 <= self._params.max_planning_retries < self._planning_retries:
            self._call_recovery(Trigger.PLANNING)

    def _make_plan(self, now_ns: int, is_renewed: bool = False) -> None:
        parts, self._planned_ns = self._parts, now_ns
        self.global_plan_in_map = parts.global_planner.make_plan(parts.inputs.base_pose_in_map, self._goal)
        parts.local_planner.set_plan(self.global_plan_in_map, is_renewed)
        self._last_plan_ns, self._planning_retries = now_ns, 0
        self.text = DRIVING

    def _is_plan_due(self, now_ns: int, default_period_s: float) -> bool:
        frequency_hz = self._params.planner_frequency
        period_s = 1.0 / frequency_hz if frequency_hz > 0.0 else default_period_s
        return self._planned_ns is None or _is_over(self._planned_ns, period_s, now_ns)

    def _replan_if_due(self, now_ns: int) -> None:
        """Make a new plan at planner_frequency while driving."""
        if self._is_plan_due(now_ns, math.inf):
            try:
                self._make_plan(now_ns, is_renewed=True)
            except PlanError as error:
                # The old plan is followed until control fails.
                log.debug('no new plan: %s', error)

    def _go_to_planning(self, now_ns: int) -> None:
        self.phase, self._planned_ns = Phase.PLANNING, None
        self._last_plan_ns = self._last_progress_ns = now_ns
        self._planning_retries = 0

    # ---- control

    def _control(self, now_ns: int) -> Command:
        inputs, local_planner = self._parts.inputs, self._parts.local_planner
        odometry, odom_pose_in_map = inputs.odometry, inputs.odom_pose_in_map
        motion = Motion(odometry.base_pose_in_odom, odometry.linear_mps, odometry.angular_radps)
        if local_planner.is_goal_reached(motion, odom_pose_in_map):
            self.end(GoalStatus.SUCCEEDED, GoalStatus.SUCCEEDED.value)
            return STOP
        motion = local_planner.odometry_motion(odometry, self.command)
        best = local_planner.compute(motion, odom_pose_in_map, self._parts.local_costmap)
        if best is None:
            self._control_failed(now_ns)
            return STOP
        self._last_control_ns = now_ns
        self.local_plan_in_odom, self.text = best.poses_in_odom, DRIVING
        self._recovery.restart_after(Trigger.CONTROLLING)
        return Command(best.linear_mps, best.angular_radps)

    def _control_failed(self, now_ns: int) -> None:
        """Go back to planning, or to recovery when patience is over."""
        self.text = self._parts.local_planner.problem
        self.local_plan_in_odom = np.empty((0, 3))
        if _is_over(self._last_control_ns, self._params.controller_patience, now_ns):
            self._call_recovery(Trigger.CONTROLLING)
            return
        progress_ns, planned_ns = self._last_progress_ns, self._planned_ns
        self._go_to_planning(now_ns)
        self._last_progress_ns, self._planned_ns = progress_ns, planned_ns

    def _watch_travel(self, now_ns: int) -> None:
        """Give up if odometry does not move although travel is commanded."""
        watch = self._parts.travel_watch
        watch.update(now_ns, self._parts.inputs.odometry.base_pose_in_odom, self.command)
        if watch.is_over_limit:
            watch.reset()
            unseen = f'{watch.limit_m:.2f} m of commanded travel (max_unseen_travel)'
            self.end(GoalStatus.ABORTED, f'odometry has not moved for {unseen}')

    def _watch_progress(self, now_ns: int) -> None:
        """Call recovery if the robot has not moved for oscillation_timeout: move_base's oscillation check."""
        here, since, params = self._parts.inputs.base_pose_in_map, self._progress_pose, self._params
        if since is None or math.hypot(here.x_m - since.x_m, here.y_m - since.y_m) >= params.oscillation_distance:
            self._progress_pose, self._last_progress_ns = here, now_ns
            self._recovery.restart_after(Trigger.OSCILLATION)
        elif (
            self.phase is Phase.CONTROLLING
            and params.oscillation_timeout > 0.0
            and _is_over(self._last_progress_ns, params.oscillation_timeout, now_ns)
        ):
            self.text = f'moved less than {params.oscillation_distance} m in {params.oscillation_timeout} s'
            self._call_recovery(Trigger.OSCILLATION)

    # ---- recovery

    def _call_recovery(self, trigger: Trigger) -> None:
        self.phase = Phase.CLEARING
        self._recovery.call(trigger, self.text)

    def _recover(self, now_ns: int) -> Command:
        """Run one period of the next behaviour; after each, planning is tried again."""
        if self._recovery.is_exhausted:
            self.end(GoalStatus.ABORTED, self._recovery.failure)
            return STOP
        parts, inputs = self._parts, self._parts.inputs
        poses = inputs.base_pose_in_map, inputs.odometry.base_pose_in_odom
        result = self._recovery.step(RecoveryView(now_ns, *poses, parts.global_costmap, parts.local_costmap))
        self.text, self.started_recovery = result.text, self._recovery.started
        if not result.is_done:
            return Command(0.0, result.angular_radps)
        log.info('%s', self.text)
        self._go_to_planning(now_ns)
        return STOP


def _is_over(since_ns: int, patience_s: float, now_ns: int) -> bool:
    return now_ns - since_ns > patience_s * NANOSECONDS_PER_SECOND
