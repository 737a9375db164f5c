"""Navigator: velocity commands that drive to a goal, by plan, control and recovery (move_base).

One control period:
1. Add new messages: `take_odometry`, `take_localization`, `take_scan`.
2. `step(now_ns)`: stop if an input is stale; update the costmaps; plan, control or recover.

Times are arguments, without clock, threads or randomness, so that equal inputs give equal commands. The global plan
is in the map frame, the local plan in odom.
"""

from __future__ import annotations

import logging
import math
from typing import Optional

import numpy as np

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND, Step, Timeline
from diff_encoder_sim.localization.occupancy_grid import OccupancyGrid, square_room
from diff_encoder_sim.navigation.costmap import Costmap
from diff_encoder_sim.navigation.costmap_params import CostmapParams
from diff_encoder_sim.navigation.dwa import cost_cloud, trajectory_cloud
from diff_encoder_sim.navigation.dwa_kernels import ScoringTask
from diff_encoder_sim.navigation.global_planner import GlobalPlanner
from diff_encoder_sim.navigation.goal_run import GoalRun, NavigatorParts
from diff_encoder_sim.navigation.local_planner import NO_POSES, LocalPlanner
from diff_encoder_sim.navigation.navigator_inputs import (
    STOP,
    Command,
    GoalStatus,
    MissingInput,
    NavigatorInputs,
    NavigatorOutput,
    Phase,
)
from diff_encoder_sim.navigation.navigator_params import NavigatorParams
from diff_encoder_sim.navigation.recovery import recoveries_of

log = logging.getLogger(__name__)

# A step at the previous time, or slightly earlier, is not a jump back in time.
TIME_TOLERANCE_NS = 100_000_000


class Navigator(NavigatorInputs):
    """Drives a robot over a map to goals."""

    def __init__(
        self, params: NavigatorParams, static_map: OccupancyGrid, laser_pose_in_base: Pose2D = IDENTITY
    ) -> None:
        super().__init__(laser_pose_in_base)
        self.params = params
        self._timeline = Timeline(TIME_TOLERANCE_NS)
        self._run: Optional[GoalRun] = None
        self._use_parts(
            Costmap(params.global_costmap, static_map),
            Costmap(params.local_costmap),
            LocalPlanner(params.DWAPlannerROS, params.control_period_s),
        )
        self._global_updated_ns: Optional[int] = None
        self._local_updated_ns: Optional[int] = None
        self._forget_travel()

    def _use_parts(self, global_costmap: Costmap, local_costmap: Costmap, local_planner: LocalPlanner) -> None:
        """Create costmaps and planners from the parameters."""
        self.global_costmap = global_costmap  # in the map frame
        self.local_costmap = local_costmap  # in the odom frame
        planner, recoveries = (
            GlobalPlanner(self.params.NavfnROS, global_costmap),
            recoveries_of(self.params, local_costmap),
        )
        self._parts = NavigatorParts(
            self.params, self, global_costmap, local_costmap, planner, local_planner, recoveries
        )

    # ---- goals and services

    def set_goal(self, goal: Pose2D) -> None:
        """Drive to a pose in the map frame; an earlier goal is dropped."""
        last = self._run
        command = last.command if last and last.status is GoalStatus.ACTIVE else STOP
        self._run = GoalRun(self._parts, goal, command)

    def cancel(self, text: str = 'cancelled') -> None:
        """Cancel the goal; the next step commands a stop."""
        if self._run and self._run.status is GoalStatus.ACTIVE:
            self._run.end(GoalStatus.PREEMPTED, text)

    def make_plan(self, start: Optional[Pose2D], goal: Pose2D, tolerance_m: float = 0.0) -> np.ndarray:
        """Return a plan (n, 3) in the map frame without following it; `start` defaults to the robot's pose.

        Raises:
            PlanError: no plan was found; the text contains the reason.
            InputFault: `start` is None and the robot's pose is unknown.
        """
        if start is None and not self.has_pose:
            raise InputFault("the robot's pose is not known yet")
        return self._parts.global_planner.make_plan(start or self.base_pose_in_map, goal, tolerance_m)

    def clear_costmaps(self) -> None:
        """Clear all obstacles that are not in the static map."""
        for costmap in (self.global_costmap, self.local_costmap):
            costmap.clear_obstacles(IDENTITY)

    def reconfigure(self, params: NavigatorParams) -> None:
        """Replace the parameters; goal, plan and obstacles of equal grids are kept."""
        old, before, self.params = self._parts, self.params, params
        local_planner = old.local_planner
        if (params.DWAPlannerROS, params.control_period_s) != (before.DWAPlannerROS, before.control_period_s):
            local_planner = LocalPlanner(params.DWAPlannerROS, params.control_period_s)
        self._use_parts(
            _costmap_with(old.global_costmap, params.global_costmap),
            _costmap_with(old.local_costmap, params.local_costmap),
            local_planner,
        )
        self._forget_travel()
        if self._run:
            self._run.reconfigure(self._parts)

    # ---- for displays

    @property
    def status(self) -> GoalStatus:
        """Return the status of the newest goal."""
        return self._run.status if self._run else GoalStatus.NONE

    @property
    def global_plan_in_map(self) -> np.ndarray:
        """Return the whole plan (n, 3) that is followed."""
        return self._run.global_plan_in_map if self._run else NO_POSES

    @property
    def local_plan_in_odom(self) -> np.ndarray:
        """Return the trajectory (n, 3) of the last command; empty if the DWA did not choose it."""
        return self._run.local_plan_in_odom if self._run else NO_POSES

    @property
    def visible_plan_in_odom(self) -> np.ndarray:
        """Return the part (n, 3) of the global plan in the local costmap; empty without a goal."""
        return self._parts.local_planner.plan_in_odom if self.status is GoalStatus.ACTIVE else NO_POSES

    @property
    def scoring_task(self) -> Optional[ScoringTask]:
        """Return the samples of the last DWA command, valid until the next step; None before the first."""
        return self._parts.local_planner.dwa.last_task

    # ---- one control period

    def step(self, now_ns: int) -> NavigatorOutput:
        """Return the command for now; call it at controller_frequency.

        Without a goal the costmaps are kept up to date and the command is zero.
        """
        if self._timeline.advance(now_ns) is Step.RESTART:
            self._restart(now_ns)
        missing = self.missing(now_ns, self.params.input_timeout)
        if missing is not None:
            return self.wait(missing)
        self._update_costmaps(now_ns)
        run = self._run
        if run is None or run.status is not GoalStatus.ACTIVE:
            return self._output(STOP)
        self._watch_travel(run, now_ns)
        return self._output(run.act(now_ns) if run.status is GoalStatus.ACTIVE else STOP)

    def wait(self, missing: MissingInput) -> NavigatorOutput:
        """Stop for this period; call it instead of `step` without odometry."""
        if self._run and self._run.status is GoalStatus.ACTIVE:
            self._run.wait(missing)
        return self._output(STOP, f'stopped: {missing}')

    def _restart(self, now_ns: int) -> None:
        """Reset after time has jumped back."""
        log.warning('time went back to %.3f s: navigation restarted', now_ns / NANOSECONDS_PER_SECOND)
        self.cancel('time went back')
        self.forget_inputs()
        self._forget_travel()
        self.clear_costmaps()
        self._global_updated_ns = self._local_updated_ns = None

    def _update_costmaps(self, now_ns: int) -> None:
        """Update each costmap at its own rate with the newest scan."""
        params = self.params
        if _is_due(self._local_updated_ns, params.local_costmap.update_frequency, now_ns):
            self.local_costmap.update(self.odometry.base_pose_in_odom, self.scan, self.laser_pose_in_odom())
            self._local_updated_ns = now_ns
        if _is_due(self._global_updated_ns, params.global_costmap.update_frequency, now_ns):
            laser_pose = self.odom_pose_in_map.compose(self.laser_pose_in_odom())
            self.global_costmap.update(self.base_pose_in_map, self.scan, laser_pose)
            self._global_updated_ns = now_ns

    def _forget_travel(self) -> None:
        self._unseen_m, self._seen_ns = 0.0, 0
        self._seen_pose: Optional[Pose2D] = None

    def _watch_travel(self, run: GoalRun, now_ns: int) -> None:
        """Abort if odometry does not move although travel is commanded.

        A turn in place counts as the travel of the nearest point of the robot's outline.
        """
        pose, limit_m = self.odometry.base_pose_in_odom, self.params.max_unseen_travel
        if pose != self._seen_pose:
            self._unseen_m, self._seen_pose = 0.0, pose
        else:
            linear_mps, angular_radps = run.command
            speed_mps = abs(linear_mps) + abs(angular_radps) * self.local_costmap.footprint.inscribed_radius_m
            self._unseen_m += speed_mps * max(0, now_ns - self._seen_ns) / NANOSECONDS_PER_SECOND
        self._seen_ns = now_ns
        if 0.0 < limit_m < self._unseen_m:
            self._forget_travel()
            unseen = f'{limit_m:.2f} m of commanded travel (max_unseen_travel)'
            run.end(GoalStatus.ABORTED, f'odometry has not moved for {unseen}')

    def _output(self, command: Command, idle_text: str = '') -> NavigatorOutput:
        run = self._run
        if run is None:
            return NavigatorOutput(STOP, GoalStatus.NONE, Phase.PLANNING, idle_text)
        return NavigatorOutput(command, run.status, run.phase, run.text, run.started_recovery)


def _costmap_with(costmap: Costmap, params: CostmapParams) -> Costmap:
    return costmap if params == costmap.params else costmap.reconfigured(params)


def _is_due(updated_ns: Optional[int], frequency_hz: float, now_ns: int) -> bool:
    # Rounding by a nanosecond must not delay it by a period.
    return updated_ns is None or now_ns - updated_ns >= NANOSECONDS_PER_SECOND / frequency_hz - 1


PERIOD_NS = 50_000_000  # of the two control periods below


def warm_up() -> None:
    """Run every kernel of the navigation once: a goal in a small room, with a turn in place.

    Takes milliseconds with numba's cache, else some seconds.
    """
    navigator = Navigator(NavigatorParams(), square_room())
    navigator.set_goal(Pose2D(1.0, 0.0, 0.0))
    # First the goal is ahead of the robot, then the robot is at the goal with another heading.
    for period, pose in enumerate((IDENTITY, Pose2D(1.0, 0.0, 1.0))):
        now_ns = period * PERIOD_NS
        navigator.take_odometry(now_ns, pose, 0.0, 0.0)
        navigator.take_localization(now_ns, IDENTITY)
        navigator.take_scan(Scan(now_ns, 0.0, 1.0, 0.1, 5.0, np.array([2.0, math.inf])))
        navigator.step(now_ns)
    task = navigator.scoring_task
    assert task is not None
    trajectory_cloud(task, IDENTITY), cost_cloud(task, IDENTITY)
    navigator.local_costmap.footprint_cost(IDENTITY)
