"""Navigation along a test's route in lockstep, as move_base_node and navigation_trial_node drive it live."""

from __future__ import annotations

import logging
from collections import deque
from typing import Callable, Deque, Optional

from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, interpolate
from diff_encoder_sim.base.seeds import generator
from diff_encoder_sim.drives.trial_definition import TrialPlan
from diff_encoder_sim.localization.amcl import Amcl, AmclEstimate
from diff_encoder_sim.localization.map_files import load_map
from diff_encoder_sim.navigation import navigator_inputs as inputs
from diff_encoder_sim.navigation.navigator import Navigator
from diff_encoder_sim.trials.publications import Publications
from diff_encoder_sim.trials.robot_params import RobotParams, latency_ns
from diff_encoder_sim.trials.route_driver import DriverOutput, RouteDriver
from diff_encoder_sim.wheels.odometry import OdometryEstimate

log = logging.getLogger(__name__)

NO_NAVIGATION = inputs.NavigatorOutput(inputs.STOP, inputs.GoalStatus.NONE, inputs.Phase.PLANNING, '')
SendCommand = Callable[[int, inputs.Command, bool], None]  # at a time [ns]; True: from the navigator
At = Callable[..., None]  # runs an action, with arguments, at a time [ns]


class NavigatingDriver:
    """AMCL, the navigator and the driver of the test's route."""

    def __init__(
        self,
        plan: TrialPlan,
        params: RobotParams,
        laser_pose_in_base: Pose2D,
        at: At,
        send: SendCommand,
        publications: Publications,
    ) -> None:
        grid, start = load_map(plan.map), plan.trial.test.start
        self._navigator = Navigator(params.navigator, grid, laser_pose_in_base)
        self._control_rate = inputs.ControlRate(params.navigator.controller_frequency)
        at_start = {'initial_pose_x': start.x, 'initial_pose_y': start.y, 'initial_pose_a': start.yaw}
        self.amcl = Amcl(params.amcl.model_copy(update=at_start), grid, generator(plan.trial.number, 'amcl'))
        self._laser_pose_in_base = laser_pose_in_base
        self._tolerance_ns = latency_ns(params.amcl.transform_tolerance)
        self._localization_latency_ns = latency_ns(params.latency.localization)
        self._driver = RouteDriver(plan.trial.test)
        self._at, self._send, self._publications = at, send, publications
        self._scans: Deque[Scan] = deque()  # newer than the newest odometry
        self._is_scan_bad = False
        self._odometry: Optional[OdometryEstimate] = None
        self._odom_pose_in_map, self._localized_until_ns = IDENTITY, -1  # as on /tf
        self.estimated_pose_in_map: Optional[Pose2D] = None
        self.navigation = NO_NAVIGATION
        publications.map(grid)

    @property
    def is_over(self) -> bool:
        """Return whether the robot rests at the end of its route."""
        return self._driver.is_over

    def take_time(self, now_ns: int) -> None:
        """Check the test's time limit and the age of the pose estimate."""
        self._apply(now_ns, now_ns, self._driver.watch(now_ns))

    def take_scan(self, scan: Scan) -> None:
        """Pass a scan to the navigator, and to localization when odometry has reached its stamp."""
        self._navigator.take_scan(scan)
        self._scans.append(scan)

    def take_odometry(self, now_ns: int, odometry: OdometryEstimate) -> None:
        """Control first, then localize, as a live AMCL finishes after the control step."""
        stamp_ns, navigator = odometry.stamp_ns, self._navigator
        speeds = odometry.linear_velocity_mps, odometry.angular_velocity_radps
        sample = inputs.OdometrySample(stamp_ns, odometry.base_pose_in_odom, *speeds, *odometry.twist_std())
        navigator.take_odometry(sample)
        if self._control_rate.is_due(stamp_ns):
            was_active = navigator.status is inputs.GoalStatus.ACTIVE
            self.navigation = navigator.step(stamp_ns)
            if was_active:
                self._send(now_ns, self.navigation.command, True)
                if self.navigation.status.is_over:
                    self._publications.goal_result(now_ns, self.navigation.status, self.navigation.text)
        if stamp_ns <= self._localized_until_ns:
            pose_in_map = self._odom_pose_in_map.compose(odometry.base_pose_in_odom)
            self.estimated_pose_in_map = pose_in_map
            self._publications.global_pose(now_ns, stamp_ns, pose_in_map)
            # The status is also that of a goal set since the navigator's last step.
            output = self._driver.step(stamp_ns, pose_in_map, navigator.status, self.navigation.text)
            self._apply(now_ns, stamp_ns, output)
        self._localize(now_ns + self._localization_latency_ns, odometry)

    def _localize(self, published_ns: int, odometry: OdometryEstimate) -> None:
        """Process the scans that odometry has reached."""
        last = self._odometry
        while self._scans and self._scans[0].stamp_ns <= odometry.stamp_ns:
            scan, pose = self._scans.popleft(), odometry.base_pose_in_odom
            if scan.stamp_ns < odometry.stamp_ns:
                if last is None:
                    continue
                fraction = (scan.stamp_ns - last.stamp_ns) / (odometry.stamp_ns - last.stamp_ns)  # as tf2
                pose = interpolate(last.base_pose_in_odom, pose, fraction)
            try:
                estimate = self.amcl.update(pose, scan, self._laser_pose_in_base)
            except InputFault as fault:
                if not self._is_scan_bad:
                    log.warning('scan dropped: %s (bad scans that follow it directly are not reported)', fault)
                self._is_scan_bad = True
                continue
            self._is_scan_bad = False
            odom_pose_in_map = None if self.amcl.is_lost else self.amcl.odom_pose_in_map
            self._at(published_ns, self._publish, published_ns, scan.stamp_ns, estimate, odom_pose_in_map)
        self._odometry = odometry

    def _publish(
        self, now_ns: int, stamp_ns: int, estimate: Optional[AmclEstimate], odom_pose_in_map: Optional[Pose2D]
    ) -> None:
        if estimate is not None:
            self._publications.amcl_pose(now_ns, estimate)
        if odom_pose_in_map is not None:
            # Post-dated as by upstream, so that it is valid until the next scan.
            self._odom_pose_in_map, until_ns = odom_pose_in_map, stamp_ns + self._tolerance_ns
            self._localized_until_ns = until_ns
            self._publications.odom_in_map(now_ns, until_ns, odom_pose_in_map)
            self._navigator.take_localization(until_ns, odom_pose_in_map)

    def _apply(self, now_ns: int, stamp_ns: int, output: DriverOutput) -> None:
        if output.goal_in_map is not None:
            if self._navigator.status is inputs.GoalStatus.ACTIVE:
                self._publications.goal_result(now_ns, inputs.GoalStatus.PREEMPTED, '')
            self._navigator.set_goal(output.goal_in_map)
            self._publications.goal(now_ns, stamp_ns, output.goal_in_map)
        if output.turn_rate_radps is not None:
            self._send(now_ns, inputs.Command(0.0, output.turn_rate_radps), False)
