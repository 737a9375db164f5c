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
from diff_encoder_sim.navigation.global_planner import GlobalPlanner
from diff_encoder_sim.navigation.goal_status import STOP, Command, GoalStatus, Phase, Trigger
from diff_encoder_sim.navigation.local_planner import LocalPlanner
from diff_encoder_sim.navigation.navigator_inputs import MissingInput, NavigatorInputs
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from diff_encoder_sim.navigation.plan_error import PlanError
from diff_encoder_sim.navigation.recovery import Recovery, RecoveryView
from diff_encoder_sim.navigation.stop_rotate import Motion
from diff_encoder_sim.navigation.travel_watch import TravelWatch

log = logging.getLogger(__name__)

# Without a planner_frequency a failed plan is tried again as often as costmaps change. Upstream's
# thread tries without a pause.
PLAN_RETRY_S = 0.2

DRIVING = 'driving to the goal'


class NavigatorParts(NamedTuple):
    """What a run works with; it outlives the run."""

    params: NavigatorParams
    inputs: NavigatorInputs
    global_costmap: Costmap
    local_costmap: Costmap
    global_planner: GlobalPlanner
    local_planner: LocalPlanner
    recoveries: List[Recovery]
    travel_watch: TravelWatch


class GoalRun:
    """Drives to one goal, or to whatever end that comes to."""

    def __init__(self, parts: NavigatorParts, goal: Pose2D, command: Command = STOP) -> None:
        """`command` is in force already: that of the run which this one takes over from."""
        self._parts, self._params = parts, parts.params
        self._goal = goal  # in the map frame
        self.status, self.phase, self.text = GoalStatus.ACTIVE, Phase.PLANNING, ''
        self.global_plan_in_map = np.empty((0, 3))
        self.local_plan_in_odom = np.empty((0, 3))
        self.command = command  # the last one given
        self._is_under_way = False  # not before the first step, nor when waiting
        self._waits_for: Optional[MissingInput] = None
        self._trigger = Trigger.PLANNING
        self._problem = ''  # what recovery was called for
        self._recovery_index = 0
        self._is_recovering = False
        self._planning_retries = 0
        self._progress_pose: Optional[Pose2D] = None
        self._planned_ns: Optional[int] = None  # the last attempt, good or not
        self._last_plan_ns = self._last_control_ns = self._last_progress_ns = 0

    def wait(self, missing: MissingInput) -> None:
        """Stand for want of an input; the next `act` goes on with fresh patience and plan."""
        if self._waits_for is None:
            log.warning('%s; stopped', missing, extra=EVENT)
        self.command, self._waits_for, self._is_under_way = STOP, missing, False
        self.text = f'stopped: {missing}'

    def end(self, status: GoalStatus, text: str) -> None:
        """Nothing more is done."""
        self.status, self.text = status, text
        self.local_plan_in_odom = np.empty((0, 3))

    def act(self, now_ns: int) -> Command:
        """The command for one control period."""
        if not self._is_under_way:
            self._set_out(now_ns)
        self._watch_travel(now_ns)
        self.command = self._act(now_ns) if self.status is GoalStatus.ACTIVE else STOP
        return self.command

    def _set_out(self, now_ns: int) -> None:
        if self._waits_for is not None:
            log.info('%s is back: planning anew', self._waits_for.what, extra=EVENT)
        self._is_under_way, self._waits_for = True, None
        self._last_control_ns = now_ns
        self._go_to_planning(now_ns)

    def _act(self, now_ns: int) -> Command:
        self._watch_progress(now_ns)
        if self.phase is Phase.CONTROLLING:
            self._keep_plan_up(now_ns)
        if self.phase is Phase.PLANNING:
            self._plan(now_ns)
        if self.status is GoalStatus.ACTIVE and self.phase is Phase.CONTROLLING:
            return self._control(now_ns)
        if self.status is GoalStatus.ACTIVE and self.phase is Phase.CLEARING:
            return self._recover(now_ns)
        return STOP

    # ---- planning

    def _plan(self, now_ns: int) -> None:
        """Make a plan; on success go on to control, out of patience call recovery."""
        if self._planned_ns is not None and not self._is_plan_due(now_ns, PLAN_RETRY_S):
            return
        try:
            self._replan(now_ns)
        except PlanError as error:
            self.text = str(error)
            self._planning_retries += 1
            if error.problem.is_lasting:
                self.end(GoalStatus.ABORTED, str(error))
            elif (
                _is_over(self._last_plan_ns, self._params.planner_patience, now_ns)
                or 0 <= self._params.max_planning_retries < self._planning_retries
            ):
                self._call_recovery(Trigger.PLANNING)
            return
        if self._trigger is Trigger.PLANNING:
            self._recovery_index = 0
        self.phase = Phase.CONTROLLING

    def _replan(self, now_ns: int) -> None:
        self._planned_ns = now_ns
        self.global_plan_in_map = self._parts.global_planner.make_plan(self._parts.inputs.base_pose_in_map, self._goal)
        self._parts.local_planner.set_plan(self.global_plan_in_map)
        self._last_plan_ns, self._planning_retries = now_ns, 0
        self.text = DRIVING

    def _is_plan_due(self, now_ns: int, default_period_s: float) -> bool:
        frequency_hz = self._params.planner_frequency
        period_s = 1.0 / frequency_hz if frequency_hz > 0.0 else default_period_s
        return self._planned_ns is None or _is_over(self._planned_ns, period_s, now_ns)

    def _keep_plan_up(self, now_ns: int) -> None:
        """While driving: replan at planner_frequency."""
        if self._is_plan_due(now_ns, math.inf):
            try:
                self._replan(now_ns)
            except PlanError as error:
                # The old plan still leads somewhere: follow it until control fails.
                log.debug('no new plan: %s', error)

    def _go_to_planning(self, now_ns: int) -> None:
        self.phase, self._planned_ns = Phase.PLANNING, None
        self._last_plan_ns = self._last_progress_ns = now_ns
        self._planning_retries = 0

    # ---- control

    def _control(self, now_ns: int) -> Command:
        parts, odometry = self._parts, self._parts.inputs.odometry
        motion = Motion(odometry.base_pose_in_odom, odometry.linear_mps, odometry.angular_radps)
        odom_pose_in_map = parts.inputs.odom_pose_in_map
        if parts.local_planner.is_goal_reached(motion, odom_pose_in_map):
            self.end(GoalStatus.SUCCEEDED, 'goal reached')
            return STOP
        motion = parts.local_planner.odometry_motion(odometry, self.command)
        best = parts.local_planner.compute(motion, odom_pose_in_map, parts.local_costmap)
        if best is None:
            self._control_failed(now_ns)
            return STOP
        self._last_control_ns = now_ns
        self.local_plan_in_odom = best.poses_in_odom
        self.text = DRIVING
        if self._trigger is Trigger.CONTROLLING:
            self._recovery_index = 0
        return Command(best.linear_mps, best.angular_radps)

    def _control_failed(self, now_ns: int) -> None:
        """Try another plan; once patience is over, call recovery."""
        self.text = self._parts.local_planner.problem
        self.local_plan_in_odom = np.empty((0, 3))
        if _is_over(self._last_control_ns, self._params.controller_patience, now_ns):
            self._call_recovery(Trigger.CONTROLLING)
            return
        progress_ns, planned_ns = self._last_progress_ns, self._planned_ns
        self._go_to_planning(now_ns)
        self._last_progress_ns, self._planned_ns = progress_ns, planned_ns

    def _watch_travel(self, now_ns: int) -> None:
        """Give up when odometry does not see what was commanded."""
        watch = self._parts.travel_watch
        watch.enter(now_ns, self._parts.inputs.odometry.base_pose_in_odom, self.command)
        if watch.is_over_limit:
            watch.forget()
            self.end(
                GoalStatus.ABORTED,
                f'odometry has not moved for {watch.limit_m:.2f} m of commanded travel (max_unseen_travel)',
            )

    def _watch_progress(self, now_ns: int) -> None:
        """move_base's oscillation check: has the robot left where it was?"""
        here, since = self._parts.inputs.base_pose_in_map, self._progress_pose
        if since is None or math.hypot(here.x_m - since.x_m, here.y_m - since.y_m) >= self._params.oscillation_distance:
            self._progress_pose, self._last_progress_ns = here, now_ns
            if self._trigger is Trigger.OSCILLATION:
                self._recovery_index = 0
        elif (
            self.phase is Phase.CONTROLLING
            and self._params.oscillation_timeout > 0.0
            and _is_over(self._last_progress_ns, self._params.oscillation_timeout, now_ns)
        ):
            self.text = f'still within {self._params.oscillation_distance} m after {self._params.oscillation_timeout} s'
            self._call_recovery(Trigger.OSCILLATION)

    # ---- recovery

    def _call_recovery(self, trigger: Trigger) -> None:
        self.phase, self._trigger, self._problem = Phase.CLEARING, trigger, self.text
        self._is_recovering = False

    def _recover(self, now_ns: int) -> Command:
        """One period of the behaviour that is next; after each, planning gets another chance."""
        recoveries = self._parts.recoveries
        if self._recovery_index >= len(recoveries):
            tried = f' after {len(recoveries)} recovery behaviours' if recoveries else ''
            self.end(GoalStatus.ABORTED, f'{self._trigger.value}{tried}: {self._problem}')
            return STOP
        recovery = recoveries[self._recovery_index]
        if not self._is_recovering:
            recovery.start()
            self._is_recovering = True
        inputs = self._parts.inputs
        result = recovery.step(
            RecoveryView(
                now_ns,
                inputs.base_pose_in_map,
                inputs.odometry.base_pose_in_odom,
                self._parts.global_costmap,
                self._parts.local_costmap,
            )
        )
        self.text = f'{recovery.name}: {result.text}'
        if not result.is_done:
            return Command(0.0, result.angular_radps)
        log.info('%s', self.text)
        self._recovery_index += 1
        self._go_to_planning(now_ns)
        return STOP


def _is_over(since_ns: int, patience_s: float, now_ns: int) -> bool:
    return now_ns - since_ns > patience_s * NANOSECONDS_PER_SECOND
