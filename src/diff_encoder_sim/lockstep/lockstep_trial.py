"""A trial in one process, on simulated time: the parts of the live graph, each at its rate.

Equal trials and parameters give equal numbers, bit for bit.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Iterator, List, NamedTuple, Optional, Union

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.encoders.encoder_sample import EncoderSample
from diff_encoder_sim.encoders.wheel_encoder import ReportingEncoder
from diff_encoder_sim.localization.amcl import AmclEstimate
from diff_encoder_sim.lockstep.driver import Driver
from diff_encoder_sim.lockstep.latency import latency_ns
from diff_encoder_sim.lockstep.navigating_driver import NavigatingDriver
from diff_encoder_sim.lockstep.publications import Publications
from diff_encoder_sim.lockstep.robot_params import RobotParams
from diff_encoder_sim.lockstep.schedule import Schedule
from diff_encoder_sim.lockstep.scripted_driver import ScriptedDriver
from diff_encoder_sim.navigation.goal_status import Command, NavigatorOutput
from diff_encoder_sim.odometry.wheel_odometry import OdometryEstimate, WheelOdometry
from diff_encoder_sim.odometry.wheel_twist import wheel_speeds_mps
from diff_encoder_sim.simulation.periods import STATES_PERIOD_NS, TICK_NS
from diff_encoder_sim.simulation.simulator import Simulator, SimulatorParams
from diff_encoder_sim.trials.trial_definition import TrialPlan
from diff_encoder_sim.trials.trial_outcome import Ending, Outcome, RouteFailed, goal_error

WORLD_POSE_IN_MAP = IDENTITY


class Report(NamedTuple):
    """The state of the trial at one /odom."""

    stamp_ns: int
    true_pose_in_map: Pose2D  # the newest /world_pose
    odometry: OdometryEstimate
    estimated_pose_in_map: Optional[Pose2D]  # /global_pose; None before localization
    estimate: Optional[AmclEstimate]  # AMCL's newest
    navigation: NavigatorOutput


class LockstepTrial:
    """A robot in its world and its driver. The map's frame is the world's."""

    def __init__(
        self,
        plan: TrialPlan,
        robot_file: Union[str, Path],
        params: RobotParams,
        publications: Optional[Publications] = None,
    ) -> None:
        """Load the files and place the robot at its start.

        Raises:
            ConfigError: a file is missing or bad, or the trial needs the live graph.
        """
        _check_supported(plan)
        trial = self._trial = plan.trial
        self._publications = publications or Publications()
        self._simulator = Simulator(plan.world, robot_file, params.simulator, trial.test.start.pose(), trial.number)
        self._encoder = ReportingEncoder(params.encoder.model_copy(update={'ppr': trial.ppr, 'seed': trial.number}))
        self._odometry = WheelOdometry(params.odometry.model_copy(update={'ppr': trial.ppr}))
        self._odometry_latency_ns = latency_ns(params.latency.odometry)
        self._command_latency_ns = latency_ns(params.latency.command)
        self._schedule = self._schedule_at_rates(params.simulator)
        self._driver = self._begin(plan, robot_file, params)
        self._reports: List[Report] = []
        self._true_pose = trial.test.start.pose()
        self.distance_m = 0.0  # path length of base_link
        self.last_report: Optional[Report] = None
        self._ending: Optional[Ending] = None

    @property
    def time_ns(self) -> int:
        """Return the simulated time."""
        return self._simulator.time_ns

    @property
    def ending(self) -> Ending:
        """Return how the trial ended, once it was run.

        Raises:
            RuntimeError: it has not ended.
        """
        if self._ending is None:
            raise RuntimeError('the trial has not ended')
        return self._ending

    @property
    def true_pose_in_map(self) -> Pose2D:
        """Return the newest /world_pose."""
        return self._true_pose

    def run(self) -> Iterator[Report]:
        """Run the trial to its `ending`, and yield a report at each /odom."""
        try:
            while self._ending is None:
                self._tick()
                yield from self._reports
                self._reports.clear()
            self._publications.ending(self._simulator.time_ns, self._ending)
        finally:
            self._simulator.close()
            # Maps and filters are freed now: the parts refer to each other in circles, which Python collects late.
            self._schedule.clear()
            del self._driver

    def _tick(self) -> None:
        try:
            self._schedule.run_until(self._simulator.time_ns)
        except RouteFailed as failure:
            self._ending = failure.ending
            return
        if self._driver.is_over:
            reason = goal_error(self._true_pose, self._trial.goal())
            self._ending = Ending(Outcome.LOST, reason) if reason else Ending(Outcome.SUCCEEDED)
            return
        self._simulator.tick()

    def _begin(self, plan: TrialPlan, robot_file: Union[str, Path], params: RobotParams) -> Driver:
        try:
            self._publications.begin(plan.trial, self._simulator, robot_file)
            return self._make_driver(plan, params)
        except BaseException:  # a full disk, a bad map: the caller has no object to close the physics by
            self._simulator.close()
            raise

    def _make_driver(self, plan: TrialPlan, params: RobotParams) -> Driver:
        if plan.trial.nav == 'scripted':
            return ScriptedDriver(plan, self._send, self._publications)
        return NavigatingDriver(
            plan, params, self._simulator.laser_pose_in_base, self._schedule, self._send, self._publications
        )

    # ---- at a rate

    def _schedule_at_rates(self, simulator: SimulatorParams) -> Schedule:
        schedule = Schedule()
        schedule.every(TICK_NS, self._read_joints)
        schedule.every(STATES_PERIOD_NS, self._sample_truth)
        schedule.every(simulator.lidar.period_ns, self._scan)
        return schedule

    def _read_joints(self) -> None:
        joints = self._simulator.joint_states()
        self._publications.joint_states(joints)
        for sample in self._encoder.update(*joints[:3]):
            self._take_report(sample)

    def _take_report(self, sample: EncoderSample) -> None:
        self._publications.encoder_pulse(self._simulator.time_ns, sample)
        estimate = self._odometry.update(*sample)
        if estimate is not None:
            due_ns = self._simulator.time_ns + self._odometry_latency_ns
            self._schedule.at(due_ns, lambda: self._take_odometry(due_ns, estimate))

    def _sample_truth(self) -> None:
        """Publish the true pose, and fail a robot that touches an obstacle."""
        now_ns = self._simulator.time_ns
        # Composed as by world_pose_node, for equal bits.
        pose = WORLD_POSE_IN_MAP.compose(self._simulator.base_pose_in_world())
        self.distance_m += math.hypot(pose.x_m - self._true_pose.x_m, pose.y_m - self._true_pose.y_m)
        self._true_pose = pose
        self._publications.models(now_ns, self._simulator)
        self._publications.world_pose(now_ns, pose)
        hit = self._simulator.obstacle_hit()
        if hit is not None:
            raise RouteFailed(Outcome.COLLISION, f'the robot touches {hit} at ({pose.x_m:.2f}, {pose.y_m:.2f}) m')
        self._driver.take_time(now_ns)

    def _scan(self) -> None:
        scan = self._simulator.scan()
        self._publications.scan(scan)
        self._driver.take_scan(scan)

    # ---- after a latency

    def _take_odometry(self, now_ns: int, estimate: OdometryEstimate) -> None:
        self._publications.odometry(now_ns, estimate)
        self._driver.take_odometry(now_ns, estimate)
        self.last_report = Report(
            estimate.stamp_ns,
            self._true_pose,
            estimate,
            self._driver.estimated_pose_in_map,
            self._driver.estimate,
            self._driver.navigation,
        )
        self._reports.append(self.last_report)

    def _send(self, now_ns: int, command: Command, is_navigators: bool) -> None:
        self._publications.command(now_ns, command, is_navigators)
        self._schedule.at(now_ns + self._command_latency_ns, lambda: self._take_command(command))

    def _take_command(self, command: Command) -> None:
        self._simulator.command(*command)
        self._encoder.take_command(*wheel_speeds_mps(*command, self._odometry.params.wheel_separation))


def _check_supported(plan: TrialPlan) -> None:
    trial = plan.trial
    if trial.odom != 'encoder' or trial.nav == 'upstream' or plan.slam != 'none':
        raise ConfigError(
            f'lockstep: given odom {trial.odom}, nav {trial.nav}, slam {plan.slam}; '
            f'allowed: encoder; embedded or scripted; none'
        )
