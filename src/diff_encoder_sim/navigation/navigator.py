"""Navigator: velocity commands that drive to a goal, by plan, control and recovery (move_base).

In a control period, new messages are added (`take_odometry`, `take_localization`, `take_scan`). `step(now_ns)` then
stops if an input is stale, updates the costmaps, and plans, controls or recovers. Equal inputs give equal commands.
"""

from __future__ import annotations

import logging
import math
from typing import Optional

import numpy as np

from diff_encoder_sim.base.errors import EVENT, InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step, Timeline
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid, square_room
from diff_encoder_sim.navigation import navigator_inputs as inputs
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.dwa import NO_POSES, LocalPlanner, cost_cloud, trajectory_cloud
from diff_encoder_sim.navigation.dwa_kernels import ScoringTask
from diff_encoder_sim.navigation.global_planner import GlobalPlanner, PlanError
from diff_encoder_sim.navigation.goal_stopping import Rotation
from diff_encoder_sim.navigation.navigator_params import ROTATE, NavigatorParams, recoveries_of

log = logging.getLogger(__name__)

TIME_TOLERANCE_NS = 100_000_000  # of steps that go back, without a jump back in time
PLAN_RETRY_S = 0.2  # without a planner_frequency: as often as costmaps change; upstream never pauses
NEVER_NS = -(1 << 62)
DRIVING = 'driving to the goal'


class Navigator(inputs.NavigatorInputs):
    """Drives a robot over a map to goals."""

    def __init__(
        self, params: NavigatorParams, static_map: OccupancyGrid, laser_pose_in_base: Pose2D = IDENTITY
    ) -> None:
        super().__init__(laser_pose_in_base)
        self._timeline = Timeline(TIME_TOLERANCE_NS)
        self.global_costmap = Costmap(params.global_costmap, static_map)  # in the map frame
        self.local_costmap = Costmap(params.local_costmap)  # in the odom frame
        self.local_planner = LocalPlanner(params.DWAPlannerROS, params.control_period_s)
        self._global_updated_ns = self._local_updated_ns = NEVER_NS
        self._use_params(params)
        self.run = GoalRun(self, IDENTITY, inputs.STOP, inputs.GoalStatus.NONE)  # of the newest goal, with its plans

    def _use_params(self, params: NavigatorParams) -> None:
        self.params = params
        self.global_planner = GlobalPlanner(params.NavfnROS, self.global_costmap)
        self.recoveries = recoveries_of(params, self.local_costmap.footprint.circumscribed_radius_m)
        self._forget_travel()

    def set_goal(self, goal: Pose2D) -> None:
        """Drive to a pose in the map frame; an earlier goal is dropped."""
        command = self.run.command if self.status is inputs.GoalStatus.ACTIVE else inputs.STOP
        self.run = GoalRun(self, goal, command, inputs.GoalStatus.ACTIVE)

    def cancel(self, text: str = 'cancelled') -> None:
        """Cancel the goal; the next step commands a stop."""
        if self.status is inputs.GoalStatus.ACTIVE:
            self.run.end(inputs.GoalStatus.PREEMPTED, text)

    def make_plan(self, start: Optional[Pose2D], goal: Pose2D, tolerance_m: float = 0.0) -> np.ndarray:
        """Return a plan (n, 3) in the map frame without following it; raise PlanError if there is none.

        Without a `start` it is from the robot's pose; raises InputFault if that is unknown.
        """
        if start is None and not self.has_pose:
            raise InputFault("the robot's pose is not known yet")
        return self.global_planner.make_plan(start or self.base_pose_in_map, goal, tolerance_m)

    def clear_costmaps(self) -> None:
        """Clear all obstacles that are not in the static map."""
        self.global_costmap.clear_obstacles(IDENTITY)
        self.local_costmap.clear_obstacles(IDENTITY)

    def reconfigure(self, params: NavigatorParams) -> None:
        """Replace the parameters; goal, plan and obstacles of equal grids are kept, recoveries start again."""
        before = self.params
        if params.global_costmap != before.global_costmap:
            self.global_costmap = self.global_costmap.reconfigured(params.global_costmap)
        if params.local_costmap != before.local_costmap:
            self.local_costmap = self.local_costmap.reconfigured(params.local_costmap)
        if (params.DWAPlannerROS, params.control_period_s) != (before.DWAPlannerROS, before.control_period_s):
            self.local_planner = LocalPlanner(params.DWAPlannerROS, params.control_period_s)
            if len(self.run.global_plan_in_map):
                self.local_planner.set_plan(self.run.global_plan_in_map)
        self._use_params(params)
        self.run.restart_recoveries()

    @property
    def status(self) -> inputs.GoalStatus:
        """Return the status of the newest goal."""
        return self.run.status

    @property
    def visible_plan_in_odom(self) -> np.ndarray:
        """Return the part (n, 3) of the global plan in the local costmap; empty without a goal."""
        return self.local_planner.plan_in_odom if self.status is inputs.GoalStatus.ACTIVE else NO_POSES

    @property
    def scoring_task(self) -> Optional[ScoringTask]:
        """Return the samples of the last DWA command, valid until the next step; None before the first."""
        return self.local_planner.dwa.last_task

    def step(self, now_ns: int) -> inputs.NavigatorOutput:
        """Return the command for now, zero without a goal; call it at controller_frequency, as it updates costmaps."""
        if self._timeline.advance(now_ns) is Step.RESTART:
            self._restart(now_ns)
        missing = self.missing(now_ns, self.params.input_timeout)
        if missing is not None:
            return self.wait(missing)
        self._update_costmaps(now_ns)
        if self.status is inputs.GoalStatus.ACTIVE:
            self._watch_travel(now_ns)
        return self._output(self.run.act(now_ns) if self.status is inputs.GoalStatus.ACTIVE else inputs.STOP)

    def wait(self, missing: inputs.MissingInput) -> inputs.NavigatorOutput:
        """Stop for this period; call it instead of `step` without odometry."""
        if self.status is inputs.GoalStatus.ACTIVE:
            self.run.wait(missing)
        return self._output(inputs.STOP)

    def _restart(self, now_ns: int) -> None:
        """Reset after time has jumped back."""
        log.warning('time went back to %.3f s: navigation restarted', now_ns / NANOSECONDS_PER_SECOND)
        self.cancel('time went back')
        self.forget_inputs()
        self._forget_travel()
        self.clear_costmaps()
        self._global_updated_ns = self._local_updated_ns = NEVER_NS

    def _update_costmaps(self, now_ns: int) -> None:
        """Update each costmap at its own rate with the newest scan."""
        if _is_due(self._local_updated_ns, self.params.local_costmap.update_frequency, now_ns):
            self.local_costmap.update(self.odometry.base_pose_in_odom, self.scan, self.laser_pose_in_odom())
            self._local_updated_ns = now_ns
        if _is_due(self._global_updated_ns, self.params.global_costmap.update_frequency, now_ns):
            laser_pose = self.odom_pose_in_map.compose(self.laser_pose_in_odom())
            self.global_costmap.update(self.base_pose_in_map, self.scan, laser_pose)
            self._global_updated_ns = now_ns

    def _forget_travel(self) -> None:
        self._unseen_m, self._seen_ns = 0.0, 0
        self._seen_pose: Optional[Pose2D] = None

    def _watch_travel(self, now_ns: int) -> None:
        """Abort if odometry does not move although travel, or a turn of the outline's nearest point, is commanded."""
        pose, limit_m = self.odometry.base_pose_in_odom, self.params.max_unseen_travel
        if pose != self._seen_pose:
            self._unseen_m, self._seen_pose = 0.0, pose
        else:
            linear_mps, angular_radps = self.run.command
            speed_mps = abs(linear_mps) + abs(angular_radps) * self.local_costmap.footprint.inscribed_radius_m
            self._unseen_m += speed_mps * max(0, now_ns - self._seen_ns) / NANOSECONDS_PER_SECOND
        self._seen_ns = now_ns
        if 0.0 < limit_m < self._unseen_m:
            self._forget_travel()
            text = f'odometry has not moved for {limit_m:.2f} m of commanded travel (max_unseen_travel)'
            self.run.end(inputs.GoalStatus.ABORTED, text)

    def _output(self, command: inputs.Command) -> inputs.NavigatorOutput:
        run = self.run
        return inputs.NavigatorOutput(command, run.status, run.phase, run.text, run.started_recovery)


def _is_due(updated_ns: int, frequency_hz: float, now_ns: int) -> bool:
    return now_ns - updated_ns >= NANOSECONDS_PER_SECOND / frequency_hz - 1  # which may be rounded


class GoalRun:
    """One goal (in the map frame) from plan to end: move_base's executeCycle, with its states and its patience."""

    def __init__(self, navigator: Navigator, goal: Pose2D, command: inputs.Command, status: inputs.GoalStatus) -> None:
        self._navigator, self._goal, self.status = navigator, goal, status
        self.phase, self.text = inputs.Phase.PLANNING, ''
        self.global_plan_in_map = NO_POSES  # (n, 3), the whole plan that is followed
        self.local_plan_in_odom = NO_POSES  # (n, 3) of the last command; empty if the DWA did not choose it
        self.command = command  # the last one returned, at first of the previous run
        self.started_recovery: Optional[inputs.StartedRecovery] = None  # in this period
        self._is_under_way = False  # False before the first step and while waiting
        self._waits_for: Optional[inputs.MissingInput] = None
        self._trigger, self._problem = inputs.Trigger.PLANNING, ''  # of the last recovery
        self.restart_recoveries()
        self._rotation: Optional[Rotation] = None
        self._planning_retries = 0
        self._progress_pose: Optional[Pose2D] = None
        self._planned_ns = NEVER_NS  # time of the last attempt, successful or not
        self._last_plan_ns = self._last_control_ns = self._last_progress_ns = 0

    def restart_recoveries(self) -> None:
        """Begin with the first recovery behaviour."""
        self._recovery_index, self._is_recovering = 0, False

    def wait(self, missing: inputs.MissingInput) -> None:
        """Stop because an input is missing; the next `act` continues with full patience and a new plan."""
        if self._waits_for is None:
            log.warning('%s; robot stopped', missing, extra=EVENT)
        self.command, self._waits_for, self._is_under_way = inputs.STOP, missing, False
        self.text, self.started_recovery = f'stopped: {missing}', None

    def end(self, status: inputs.GoalStatus, text: str) -> None:
        """End the run with a status and its reason."""
        self.status, self.text, self.started_recovery, self.local_plan_in_odom = status, text, None, NO_POSES

    def act(self, now_ns: int) -> inputs.Command:
        """Return the command for one control period of an active goal."""
        if not self._is_under_way:
            if self._waits_for is not None:
                log.info('%s received again: driving on with a new plan', self._waits_for.what, extra=EVENT)
            self._is_under_way, self._waits_for, self._last_control_ns = True, None, now_ns
            self._go_to_planning(now_ns)
        self.started_recovery = None
        self._watch_progress(now_ns)
        if self.phase is inputs.Phase.CONTROLLING and self._is_plan_due(now_ns, math.inf):
            try:
                self._make_plan(now_ns, is_renewed=True)
            except PlanError as error:
                log.debug('no new plan: %s', error)  # the old one is followed until control fails
        if self.phase is inputs.Phase.PLANNING and self._is_plan_due(now_ns, PLAN_RETRY_S):
            self._plan(now_ns)
        if self.status is not inputs.GoalStatus.ACTIVE or self.phase is inputs.Phase.PLANNING:
            self.command = inputs.STOP
        else:
            self.command = self._control(now_ns) if self.phase is inputs.Phase.CONTROLLING else self._recover(now_ns)
        return self.command

    def _plan(self, now_ns: int) -> None:
        """Make a plan; go on to control, or to recovery when patience is over."""
        try:
            self._make_plan(now_ns)
            self._restart_recoveries_after(inputs.Trigger.PLANNING)
            self.phase = inputs.Phase.CONTROLLING
        except PlanError as error:
            params, self.text = self._navigator.params, str(error)
            self._planning_retries += 1
            is_patience_over = _is_over(self._last_plan_ns, params.planner_patience, now_ns)
            if error.is_lasting:
                self.end(inputs.GoalStatus.ABORTED, str(error))
            elif is_patience_over or 0 <= params.max_planning_retries < self._planning_retries:
                self._call_recovery(inputs.Trigger.PLANNING)

    def _make_plan(self, now_ns: int, is_renewed: bool = False) -> None:
        self._planned_ns = now_ns
        self.global_plan_in_map = self._navigator.make_plan(None, self._goal)
        self._navigator.local_planner.set_plan(self.global_plan_in_map, is_renewed)
        self._last_plan_ns, self._planning_retries, self.text = now_ns, 0, DRIVING

    def _is_plan_due(self, now_ns: int, default_period_s: float) -> bool:
        frequency_hz = self._navigator.params.planner_frequency
        period_s = 1.0 / frequency_hz if frequency_hz > 0.0 else default_period_s
        return _is_over(self._planned_ns, period_s, now_ns)

    def _go_to_planning(self, now_ns: int) -> None:
        self.phase, self._planned_ns, self._planning_retries = inputs.Phase.PLANNING, NEVER_NS, 0
        self._last_plan_ns = self._last_progress_ns = now_ns

    def _control(self, now_ns: int) -> inputs.Command:
        navigator, planner = self._navigator, self._navigator.local_planner
        odometry, odom_pose_in_map = navigator.odometry, navigator.odom_pose_in_map
        if planner.is_goal_reached(odometry, odom_pose_in_map):
            self.end(inputs.GoalStatus.SUCCEEDED, inputs.GoalStatus.SUCCEEDED.value)
            return inputs.STOP
        best = planner.compute(odometry, self.command, odom_pose_in_map, navigator.local_costmap)
        if best is not None:
            self._last_control_ns = now_ns
            self.local_plan_in_odom, self.text = best.poses, DRIVING
            self._restart_recoveries_after(inputs.Trigger.CONTROLLING)
            return inputs.Command(best.linear_mps, best.angular_radps)
        self.text, self.local_plan_in_odom = planner.problem, NO_POSES
        if _is_over(self._last_control_ns, navigator.params.controller_patience, now_ns):
            self._call_recovery(inputs.Trigger.CONTROLLING)
        else:  # plan again, but not sooner than is due
            self.phase, self._last_plan_ns, self._planning_retries = inputs.Phase.PLANNING, now_ns, 0
        return inputs.STOP

    def _watch_progress(self, now_ns: int) -> None:
        """Call recovery if the robot has not moved for oscillation_timeout: move_base's oscillation check."""
        here, since, params = self._navigator.base_pose_in_map, self._progress_pose, self._navigator.params
        limit_s, limit_m, last_ns = params.oscillation_timeout, params.oscillation_distance, self._last_progress_ns
        if since is None or math.hypot(here.x_m - since.x_m, here.y_m - since.y_m) >= limit_m:
            self._progress_pose, self._last_progress_ns = here, now_ns
            self._restart_recoveries_after(inputs.Trigger.OSCILLATION)
        elif self.phase is inputs.Phase.CONTROLLING and limit_s > 0.0 and _is_over(last_ns, limit_s, now_ns):
            self.text = f'moved less than {limit_m} m in {limit_s} s'
            self._call_recovery(inputs.Trigger.OSCILLATION)

    def _call_recovery(self, trigger: inputs.Trigger) -> None:
        self.phase, self._trigger, self._problem, self._is_recovering = inputs.Phase.CLEARING, trigger, self.text, False

    def _restart_recoveries_after(self, trigger: inputs.Trigger) -> None:
        """Go back to the first behaviour if the reason of the last recovery is over."""
        if self._trigger is trigger:
            self._recovery_index = 0

    def _recover(self, now_ns: int) -> inputs.Command:
        """Run one period of the next behaviour; after each, planning is tried again."""
        navigator, recoveries = self._navigator, self._navigator.recoveries
        if self._recovery_index >= len(recoveries):
            tried = f' after {len(recoveries)} recovery behaviours' if recoveries else ''
            self.end(inputs.GoalStatus.ABORTED, f'{self._trigger.value}{tried}: {self._problem}')
            return inputs.STOP
        pose_in_odom, recovery = navigator.odometry.base_pose_in_odom, recoveries[self._recovery_index]
        if not self._is_recovering:
            self._is_recovering, self._rotation = True, None
            self.started_recovery = inputs.StartedRecovery(recovery.name, self._recovery_index, len(recoveries))
        if recovery.type == ROTATE:
            self._rotation = self._rotation or Rotation(navigator.params.DWAPlannerROS, now_ns, pose_in_odom)
            angular_radps, text = self._rotation.step(now_ns, pose_in_odom, navigator.local_costmap)
        else:
            navigator.global_costmap.clear_obstacles(navigator.base_pose_in_map, recovery.reset_distance_m)
            navigator.local_costmap.clear_obstacles(pose_in_odom, recovery.reset_distance_m)
            angular_radps, text = None, f'obstacles outside a square of {recovery.reset_distance_m:.2f} m forgotten'
        self.text = f'{recovery.name}: {text}'
        if angular_radps is not None:
            return inputs.Command(0.0, angular_radps)
        self._recovery_index += 1
        log.info('%s', self.text)
        self._go_to_planning(now_ns)
        return inputs.STOP


def _is_over(since_ns: int, patience_s: float, now_ns: int) -> bool:
    return now_ns - since_ns > patience_s * NANOSECONDS_PER_SECOND


def warm_up() -> None:
    """Run every kernel of the navigation once: milliseconds with numba's cache, else some seconds."""
    navigator = Navigator(NavigatorParams(), square_room())
    navigator.set_goal(Pose2D(1.0, 0.0, 0.0))
    # First the goal is ahead of the robot, then the robot is at the goal with another heading.
    for now_ns, pose in ((0, IDENTITY), (50_000_000, Pose2D(1.0, 0.0, 1.0))):
        navigator.take_odometry(inputs.OdometrySample(now_ns, pose, 0.0, 0.0))
        navigator.take_localization(now_ns, IDENTITY)
        navigator.take_scan(Scan(now_ns, 0.0, 1.0, 0.1, 5.0, np.array([2.0, math.inf])))
        navigator.step(now_ns)
    task = navigator.scoring_task
    assert task is not None
    trajectory_cloud(task, IDENTITY), cost_cloud(task, IDENTITY)
    navigator.local_costmap.footprint_cost(IDENTITY)
