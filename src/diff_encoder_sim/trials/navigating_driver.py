"""Navigation along a test's route in lockstep, as move_base_node and navigation_trial_node drive it live."""

from __future__ import annotations

from typing import Optional

from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.trial_definition import Outcome, RouteFailed, TrialPlan
from diff_encoder_sim.localization.amcl import AmclEstimate
from diff_encoder_sim.localization.map_files import load_map
from diff_encoder_sim.navigation.navigator import Navigator
from diff_encoder_sim.navigation.navigator_inputs import Command, ControlRate, GoalStatus
from diff_encoder_sim.trials.driver import NO_NAVIGATION, SendCommand
from diff_encoder_sim.trials.localizer import Localizer
from diff_encoder_sim.trials.publications import Publications
from diff_encoder_sim.trials.robot_params import RobotParams
from diff_encoder_sim.trials.route_driver import DriverOutput, RouteDriver
from diff_encoder_sim.trials.schedule import Schedule
from diff_encoder_sim.wheels.odometry import OdometryEstimate


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
        grid = load_map(plan.map)
        self._navigator = Navigator(params.navigator, grid, laser_pose_in_base)
        self._control_rate = ControlRate(params.navigator.controller_frequency)
        self._localizer = Localizer(
            plan.trial, params, grid, laser_pose_in_base, schedule, publications, self._navigator.take_localization
        )
        self._driver = RouteDriver(plan.trial.test)
        self._send, self._publications = send, publications
        self.estimated_pose_in_map: Optional[Pose2D] = None
        self.navigation = NO_NAVIGATION
        publications.map(grid)

    @property
    def is_over(self) -> bool:
        """Return whether the robot rests at the end of its route."""
        return self._driver.is_over

    @property
    def estimate(self) -> Optional[AmclEstimate]:
        """Return AMCL's newest estimate, None before the first."""
        return self._localizer.last_estimate

    def take_time(self, now_ns: int) -> None:
        """Check the test's time limit and the age of the pose estimate."""
        try:
            self._apply(now_ns, now_ns, self._driver.watch(now_ns))
        except RouteFailed as failure:
            raise self._explained(failure) from None

    def take_scan(self, scan: Scan) -> None:
        """Hand a scan to the navigator and to localization."""
        self._navigator.take_scan(scan)
        self._localizer.take_scan(scan)

    def take_odometry(self, now_ns: int, estimate: OdometryEstimate) -> None:
        """Control first, then localize: a live AMCL is still at work while the robot is controlled."""
        try:
            self._control(now_ns, estimate)
        except RouteFailed as failure:
            raise self._explained(failure) from None
        self._localizer.take_odometry(now_ns, estimate)

    def _control(self, now_ns: int, odometry: OdometryEstimate) -> None:
        stamp_ns = odometry.stamp_ns
        self._navigator.take_odometry(
            stamp_ns,
            odometry.base_pose_in_odom,
            odometry.linear_velocity_mps,
            odometry.angular_velocity_radps,
            *odometry.twist_std(),
        )
        if self._control_rate.is_due(stamp_ns):
            self._step_navigator(now_ns, stamp_ns)
        pose_in_map = self._localizer.pose_in_map(odometry)
        if pose_in_map is not None:
            self.estimated_pose_in_map = pose_in_map
            self._publications.global_pose(now_ns, stamp_ns, pose_in_map)
            # The status is that of a goal set since the navigator's last step, too.
            status, text = self._navigator.status, self.navigation.text
            self._apply(now_ns, stamp_ns, self._driver.step(stamp_ns, pose_in_map, status, text))

    def _step_navigator(self, now_ns: int, stamp_ns: int) -> None:
        was_active = self._navigator.status is GoalStatus.ACTIVE
        self.navigation = self._navigator.step(stamp_ns)
        if was_active:
            self._send(now_ns, self.navigation.command, True)
            if self.navigation.status.is_over:
                self._publications.goal_result(now_ns, self.navigation.status, self.navigation.text)

    def _apply(self, now_ns: int, stamp_ns: int, output: DriverOutput) -> None:
        if output.goal_in_map is not None:
            if self._navigator.status is GoalStatus.ACTIVE:
                self._publications.goal_result(now_ns, GoalStatus.PREEMPTED, '')
            self._navigator.set_goal(output.goal_in_map)
            self._publications.goal(now_ns, stamp_ns, output.goal_in_map)
        if output.turn_rate_radps is not None:
            self._send(now_ns, Command(0.0, output.turn_rate_radps), False)

    def _explained(self, failure: RouteFailed) -> RouteFailed:
        """Return the failure as one of localization where AMCL has found the robot to be lost."""
        if not self._localizer.is_lost:
            return failure
        return RouteFailed(Outcome.LOST, f'localization is lost; {failure}')
