"""Who drives a trial in lockstep: navigation by what the robot believes, or a script."""

from __future__ import annotations

import logging
from collections import deque
from typing import Callable, Deque, Optional

from typing_extensions import Protocol

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, interpolate
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.localization.amcl import Amcl, AmclEstimate
from diff_encoder_sim.lockstep.latency import latency_ns
from diff_encoder_sim.lockstep.publications import Publications
from diff_encoder_sim.lockstep.robot_params import RobotParams
from diff_encoder_sim.lockstep.schedule import Schedule
from diff_encoder_sim.mapping.map_files import load_map
from diff_encoder_sim.navigation.control_rate import ControlRate
from diff_encoder_sim.navigation.goal_status import STOP, Command, GoalStatus, NavigatorOutput, Phase
from diff_encoder_sim.navigation.navigator import Navigator
from diff_encoder_sim.odometry.wheel_odometry import OdometryEstimate
from diff_encoder_sim.trials.route_driver import DriverOutput, RouteDriver
from diff_encoder_sim.trials.scripted_drive import ScriptedDrive
from diff_encoder_sim.trials.trial_definition import TrialPlan
from diff_encoder_sim.trials.trial_outcome import Outcome, RouteFailed

log = logging.getLogger(__name__)

NO_NAVIGATION = NavigatorOutput(STOP, GoalStatus.NONE, Phase.PLANNING, '')

# At a time [ns]; whether it is the navigator's.
SendCommand = Callable[[int, Command, bool], None]


class Driver(Protocol):
    """What the trial asks of whoever drives."""

    is_over: bool
    estimate: Optional[AmclEstimate]  # AMCL's newest, if there is one
    estimated_pose_in_map: Optional[Pose2D]  # /global_pose as it was said last
    navigation: NavigatorOutput

    def take_true_time(self, now_ns: int) -> None:
        """A /world_pose has come; only its time counts. Raises RouteFailed."""

    def take_scan(self, scan: Scan) -> None:
        """A sweep has come."""

    def take_odometry(self, now_ns: int, estimate: OdometryEstimate) -> None:
        """An /odom has come: decide what to do. Raises RouteFailed."""


class ScriptedDriver:
    """Drives by time alone; the map is where the surveyed start says."""

    estimate = None
    navigation = NO_NAVIGATION

    def __init__(self, plan: TrialPlan, send: SendCommand, publications: Publications) -> None:
        self._drive = ScriptedDrive(plan.trial.test)
        self._start_pose = plan.trial.test.start.pose()
        self._send, self._publications = send, publications
        self.estimated_pose_in_map: Optional[Pose2D] = None
        self.is_over = False

    def take_true_time(self, now_ns: int) -> None:
        """Send the command for the period that begins."""
        elapsed_s = now_ns / NANOSECONDS_PER_SECOND
        self._send(now_ns, Command(*self._drive.command_at(elapsed_s)), False)
        self.is_over = self._drive.is_over(elapsed_s)

    def take_scan(self, scan: Scan) -> None:
        """Nobody looks at it."""

    def take_odometry(self, now_ns: int, estimate: OdometryEstimate) -> None:
        """Say where that is on the map."""
        self.estimated_pose_in_map = self._start_pose.compose(estimate.base_pose_in_odom)
        self._publications.global_pose(now_ns, estimate.stamp_ns, self.estimated_pose_in_map)


class NavigatingDriver:
    """AMCL, the navigator and the driver of the test's route."""

    def __init__(
        self,
        plan: TrialPlan,
        params: RobotParams,
        laser_pose_in_base: Pose2D,
        schedule: Schedule,
        send: SendCommand,
        publications: Publications,
    ) -> None:
        grid, start = load_map(plan.map), plan.trial.test.start
        at_start = {'initial_pose_x': start.x, 'initial_pose_y': start.y, 'initial_pose_a': start.yaw}
        self._amcl = Amcl(params.amcl.model_copy(update=at_start), grid, generator(plan.trial.number, 'amcl'))
        self._tolerance_ns = latency_ns(params.amcl.transform_tolerance)
        self._latency_ns = latency_ns(params.latency.localization)
        self._laser_pose = laser_pose_in_base
        self._navigator = Navigator(params.navigator, grid, laser_pose_in_base)
        self._control_rate = ControlRate(params.navigator.controller_frequency)
        self._driver = RouteDriver(plan.trial.test)
        self._schedule, self._send, self._publications = schedule, send, publications
        self._scans: Deque[Scan] = deque()  # that odometry has not come to
        self._is_scan_bad = False
        self._odometry: Optional[OdometryEstimate] = None
        self._odom_pose_in_map, self._localized_until_ns = IDENTITY, -1  # as /tf has it
        self.estimated_pose_in_map: Optional[Pose2D] = None
        self.navigation = NO_NAVIGATION
        publications.map(grid)

    @property
    def is_over(self) -> bool:
        """Whether the robot rests at the end of its route."""
        return self._driver.is_over

    @property
    def estimate(self) -> Optional[AmclEstimate]:
        """AMCL's newest."""
        return self._amcl.last_estimate

    def take_true_time(self, now_ns: int) -> None:
        """Watch over the test's time limit."""
        try:
            self._apply(now_ns, now_ns, self._driver.watch(now_ns))
        except RouteFailed as failure:
            raise self._explained(failure) from None

    def take_scan(self, scan: Scan) -> None:
        """Let the navigator see it, and localize when odometry has come to it."""
        self._navigator.take_scan(scan)
        self._scans.append(scan)

    def take_odometry(self, now_ns: int, estimate: OdometryEstimate) -> None:
        """One control period; then, as a live AMCL is at work meanwhile, localization."""
        try:
            self._control(now_ns, estimate)
        except RouteFailed as failure:
            raise self._explained(failure) from None
        while self._scans and self._scans[0].stamp_ns <= estimate.stamp_ns:
            self._localize(now_ns, self._scans.popleft(), estimate)
        self._odometry = estimate

    # ---- control

    def _control(self, now_ns: int, odometry: OdometryEstimate) -> None:
        stamp_ns, navigator = odometry.stamp_ns, self._navigator
        navigator.take_odometry(
            stamp_ns,
            odometry.base_pose_in_odom,
            odometry.linear_velocity_mps,
            odometry.angular_velocity_radps,
            *odometry.twist_std(),
        )
        if self._control_rate.is_due(stamp_ns):
            self._step_navigator(now_ns, stamp_ns)
        if stamp_ns <= self._localized_until_ns:
            self.estimated_pose_in_map = self._odom_pose_in_map.compose(odometry.base_pose_in_odom)
            self._publications.global_pose(now_ns, stamp_ns, self.estimated_pose_in_map)
            self._drive_on(now_ns, stamp_ns)

    def _step_navigator(self, now_ns: int, stamp_ns: int) -> None:
        was_active = self._navigator.status is GoalStatus.ACTIVE
        self.navigation = self._navigator.step(stamp_ns)
        if was_active:
            self._send(now_ns, self.navigation.command, True)
            self._publish_result(now_ns)

    def _drive_on(self, now_ns: int, stamp_ns: int) -> None:
        self._apply(
            now_ns,
            stamp_ns,
            self._driver.step(stamp_ns, self.estimated_pose_in_map, self._navigator.status, self.navigation.text),
        )

    def _apply(self, now_ns: int, stamp_ns: int, wanted: DriverOutput) -> None:
        if wanted.goal_in_map is not None:
            if self._navigator.status is GoalStatus.ACTIVE:
                self._publications.goal_result(now_ns, GoalStatus.PREEMPTED, '')
            self._navigator.set_goal(wanted.goal_in_map)
            self._publications.goal(now_ns, stamp_ns, wanted.goal_in_map)
        if wanted.turn_rate_radps is not None:
            self._send(now_ns, Command(0.0, wanted.turn_rate_radps), False)

    def _publish_result(self, now_ns: int) -> None:
        if self.navigation.status.is_over:
            self._publications.goal_result(now_ns, self.navigation.status, self.navigation.text)

    def _explained(self, failure: RouteFailed) -> RouteFailed:
        """A robot that does not know where it is fails for that."""
        if not self._amcl.is_lost:
            return failure
        return RouteFailed(Outcome.LOST, f'localization is lost; {failure}')

    # ---- localization

    def _localize(self, now_ns: int, scan: Scan, odometry: OdometryEstimate) -> None:
        pose = self._odom_pose_at(scan.stamp_ns, odometry)
        if pose is None:
            return
        try:
            estimate = self._amcl.update(pose, scan, self._laser_pose)
        except InputFault as fault:
            if not self._is_scan_bad:
                log.warning('scan dropped: %s (bad scans that follow it directly are not reported)', fault)
            self._is_scan_bad = True
            return
        self._is_scan_bad = False
        odom_pose_in_map = None if self._amcl.is_lost else self._amcl.odom_pose_in_map
        told_ns = now_ns + self._latency_ns
        self._schedule.at(told_ns, lambda: self._tell(told_ns, scan.stamp_ns, estimate, odom_pose_in_map))

    def _odom_pose_at(self, stamp_ns: int, newest: OdometryEstimate) -> Optional[Pose2D]:
        """As tf2 has it: interpolated between two estimates; None before the first."""
        if stamp_ns == newest.stamp_ns:
            return newest.base_pose_in_odom
        if self._odometry is None:
            return None
        share = (stamp_ns - self._odometry.stamp_ns) / (newest.stamp_ns - self._odometry.stamp_ns)
        return interpolate(self._odometry.base_pose_in_odom, newest.base_pose_in_odom, share)

    def _tell(
        self, now_ns: int, stamp_ns: int, estimate: Optional[AmclEstimate], odom_pose_in_map: Optional[Pose2D]
    ) -> None:
        if estimate is not None:
            self._publications.amcl_pose(now_ns, estimate)
        if odom_pose_in_map is not None:
            # Dated ahead, as upstream does: newer odometry finds it until the next scan.
            self._localized_until_ns = stamp_ns + self._tolerance_ns
            self._odom_pose_in_map = odom_pose_in_map
            self._publications.odom_in_map(now_ns, self._localized_until_ns, odom_pose_in_map)
            self._navigator.take_localization(self._localized_until_ns, odom_pose_in_map)
