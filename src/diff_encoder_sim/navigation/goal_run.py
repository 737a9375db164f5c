"""One goal from plan to end: move_base's executeCycle, with its three states and its patience."""

from __future__ import annotations

import logging
import math
from typing import List, NamedTuple, Optional

from diff_encoder_sim.base.errors import EVENT
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.global_planner import GlobalPlanner, PlanError
from diff_encoder_sim.navigation.local_planner import NO_POSES, LocalPlanner
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
from diff_encoder_sim.navigation.navigator_params import ROTATE, NavigatorParams
from diff_encoder_sim.navigation.recovery import Recovery, Rotation

log = logging.getLogger(__name__)

# Without a planner_frequency a failed plan is retried as often as costmaps change. Upstream's thread retries without
# a pause.
PLAN_RETRY_S = 0.2

DRIVING = 'driving to the goal'


class NavigatorParts(NamedTuple):
    """Parts of the navigator that a run uses, of one set of parameters."""

    params: NavigatorParams
    inputs: NavigatorInputs
    global_costmap: Costmap
    local_costmap: Costmap
    global_planner: GlobalPlanner
    local_planner: LocalPlanner
    recoveries: List[Recovery]


class GoalRun:
    """Drives to one goal until it is reached, given up or cancelled.

    Args:
        parts: of the navigator.
        goal: in the map frame.
        command: the command in force, of the run before this one.
    """

    def __init__(self, parts: NavigatorParts, goal: Pose2D, command: Command = STOP) -> None:
        self._parts, self._goal = parts, goal
        self.status, self.phase, self.text = GoalStatus.ACTIVE, Phase.PLANNING, ''
        self.global_plan_in_map = self.local_plan_in_odom = NO_POSES
        self.command = command  # the last one returned
        self.started_recovery: Optional[StartedRecovery] = None  # in this period
        self._is_under_way = False  # False before the first step and while waiting
        self._waits_for: Optional[MissingInput] = None
        self._trigger, self._problem = Trigger.PLANNING, ''  # of the last recovery
        self._recovery_index = 0  # of the behaviour that is next
        self._is_recovering = False
        self._rotation: Optional[Rotation] = None
        self._planning_retries = 0
        self._progress_pose: Optional[Pose2D] = None
        self._planned_ns: Optional[int] = None  # time of the last attempt, successful or not
        self._last_plan_ns = self._last_control_ns = self._last_progress_ns = 0

    def reconfigure(self, parts: NavigatorParts) -> None:
        """Continue with other parts, along the same plan; recovery behaviours start again."""
        if parts.local_planner is not self._parts.local_planner and len(self.global_plan_in_map):
            parts.local_planner.set_plan(self.global_plan_in_map)
        self._parts, self._recovery_index, self._is_recovering = parts, 0, False

    def wait(self, missing: MissingInput) -> None:
        """Stop because an input is missing; the next `act` continues with full patience and a new plan."""
        if self._waits_for is None:
            log.warning('%s; robot stopped', missing, extra=EVENT)
        self.command, self._waits_for, self._is_under_way = STOP, missing, False
        self.started_recovery = None
        self.text = f'stopped: {missing}'

    def end(self, status: GoalStatus, text: str) -> None:
        """End the run with a status and its reason."""
        self.status, self.text, self.started_recovery = status, text, None
        self.local_plan_in_odom = NO_POSES

    def act(self, now_ns: int) -> Command:
        """Return the command for one control period of an active goal."""
        if not self._is_under_way:
            if self._waits_for is not None:
                log.info('%s received again: driving on with a new plan', self._waits_for.what, extra=EVENT)
            self._is_under_way, self._waits_for = True, None
            self._last_control_ns = now_ns
            self._go_to_planning(now_ns)
        self.started_recovery = None
        self._watch_progress(now_ns)
        if self.phase is Phase.CONTROLLING and self._is_plan_due(now_ns, math.inf):
            try:
                self._make_plan(now_ns, is_renewed=True)
            except PlanError as error:
                log.debug('no new plan: %s', error)  # the old one is followed until control fails
        if self.phase is Phase.PLANNING:
            self._plan(now_ns)
        if self.status is not GoalStatus.ACTIVE or self.phase is Phase.PLANNING:
            self.command = STOP
        else:
            self.command = self._control(now_ns) if self.phase is Phase.CONTROLLING else self._recover(now_ns)
        return self.command

    # ---- planning

    def _plan(self, now_ns: int) -> None:
        """Make a plan; go on to control, or to recovery when patience is over."""
        if self._planned_ns is not None and not self._is_plan_due(now_ns, PLAN_RETRY_S):
            return
        try:
            self._make_plan(now_ns)
            self._restart_recovery_after(Trigger.PLANNING)
            self.phase = Phase.CONTROLLING
        except PlanError as error:
            params, self.text = self._parts.params, str(error)
            self._planning_retries += 1
            is_patience_over = _is_over(self._last_plan_ns, params.planner_patience, now_ns)
            if error.problem.is_lasting:
                self.end(GoalStatus.ABORTED, str(error))
            elif is_patience_over or 0 <= params.max_planning_retries < self._planning_retries:
                self._call_recovery(Trigger.PLANNING)

    def _make_plan(self, now_ns: int, is_renewed: bool = False) -> None:
        parts, self._planned_ns = self._parts, now_ns
        self.global_plan_in_map = parts.global_planner.make_plan(parts.inputs.base_pose_in_map, self._goal)
        parts.local_planner.set_plan(self.global_plan_in_map, is_renewed)
        self._last_plan_ns, self._planning_retries = now_ns, 0
        self.text = DRIVING

    def _is_plan_due(self, now_ns: int, default_period_s: float) -> bool:
        frequency_hz = self._parts.params.planner_frequency
        period_s = 1.0 / frequency_hz if frequency_hz > 0.0 else default_period_s
        return self._planned_ns is None or _is_over(self._planned_ns, period_s, now_ns)

    def _go_to_planning(self, now_ns: int) -> None:
        self.phase, self._planned_ns = Phase.PLANNING, None
        self._last_plan_ns = self._last_progress_ns = now_ns
        self._planning_retries = 0

    # ---- control

    def _control(self, now_ns: int) -> Command:
        parts = self._parts
        odometry, odom_pose_in_map, planner = parts.inputs.odometry, parts.inputs.odom_pose_in_map, parts.local_planner
        if planner.is_goal_reached(odometry, odom_pose_in_map):
            self.end(GoalStatus.SUCCEEDED, GoalStatus.SUCCEEDED.value)
            return STOP
        best = planner.compute(odometry, self.command, odom_pose_in_map, parts.local_costmap)
        if best is not None:
            self._last_control_ns = now_ns
            self.local_plan_in_odom, self.text = best.poses_in_odom, DRIVING
            self._restart_recovery_after(Trigger.CONTROLLING)
            return Command(best.linear_mps, best.angular_radps)
        self.text, self.local_plan_in_odom = planner.problem, NO_POSES
        if _is_over(self._last_control_ns, parts.params.controller_patience, now_ns):
            self._call_recovery(Trigger.CONTROLLING)
        else:
            progress_ns, planned_ns = self._last_progress_ns, self._planned_ns
            self._go_to_planning(now_ns)
            self._last_progress_ns, self._planned_ns = progress_ns, planned_ns
        return STOP

    def _watch_progress(self, now_ns: int) -> None:
        """Call recovery if the robot has not moved for oscillation_timeout: move_base's oscillation check."""
        here, since, params = self._parts.inputs.base_pose_in_map, self._progress_pose, self._parts.params
        if since is None or math.hypot(here.x_m - since.x_m, here.y_m - since.y_m) >= params.oscillation_distance:
            self._progress_pose, self._last_progress_ns = here, now_ns
            self._restart_recovery_after(Trigger.OSCILLATION)
        elif (
            self.phase is Phase.CONTROLLING
            and params.oscillation_timeout > 0.0
            and _is_over(self._last_progress_ns, params.oscillation_timeout, now_ns)
        ):
            self.text = f'moved less than {params.oscillation_distance} m in {params.oscillation_timeout} s'
            self._call_recovery(Trigger.OSCILLATION)

    # ---- recovery

    def _call_recovery(self, trigger: Trigger) -> None:
        self.phase, self._trigger, self._problem, self._is_recovering = Phase.CLEARING, trigger, self.text, False

    def _restart_recovery_after(self, trigger: Trigger) -> None:
        """Go back to the first behaviour if the last recovery had this reason, which is over."""
        if self._trigger is trigger:
            self._recovery_index = 0

    def _recover(self, now_ns: int) -> Command:
        """Run one period of the next behaviour; after each, planning is tried again."""
        parts, recoveries = self._parts, self._parts.recoveries
        if self._recovery_index >= len(recoveries):
            tried = f' after {len(recoveries)} recovery behaviours' if recoveries else ''
            self.end(GoalStatus.ABORTED, f'{self._trigger.value}{tried}: {self._problem}')
            return STOP
        pose_in_odom, recovery = parts.inputs.odometry.base_pose_in_odom, recoveries[self._recovery_index]
        if not self._is_recovering:
            self._is_recovering, self._rotation = True, None
            self.started_recovery = StartedRecovery(recovery.name, self._recovery_index, len(recoveries))
        if recovery.type == ROTATE:
            self._rotation = self._rotation or Rotation(parts.params.DWAPlannerROS, now_ns, pose_in_odom)
            angular_radps, text = self._rotation.step(now_ns, pose_in_odom, parts.local_costmap)
        else:
            parts.global_costmap.clear_obstacles(parts.inputs.base_pose_in_map, recovery.reset_distance_m)
            parts.local_costmap.clear_obstacles(pose_in_odom, recovery.reset_distance_m)
            angular_radps, text = None, f'obstacles outside a square of {recovery.reset_distance_m:.2f} m forgotten'
        self.text = f'{recovery.name}: {text}'
        if angular_radps is not None:
            return Command(0.0, angular_radps)
        self._recovery_index += 1
        log.info('%s', self.text)
        self._go_to_planning(now_ns)
        return STOP


def _is_over(since_ns: int, patience_s: float, now_ns: int) -> bool:
    return now_ns - since_ns > patience_s * NANOSECONDS_PER_SECOND
