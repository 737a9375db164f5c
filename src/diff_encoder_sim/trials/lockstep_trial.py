"""A trial in one process, on simulated time: the parts of the live graph, each at its rate.

Equal trials give equal numbers, bit for bit. The map's frame is the world's.
"""

from __future__ import annotations

import heapq
import itertools
import math
from array import array
from pathlib import Path
from typing import Any, Callable, Iterator, List, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.imu import ImuSample
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.drives.trial_definition import Ending, Outcome, RouteFailed, Trial, TrialPlan, goal_error
from diff_encoder_sim.localization.amcl import AmclEstimate
from diff_encoder_sim.localization.fused_odometry import FusedOdometry, ImuReading
from diff_encoder_sim.navigation.navigator_inputs import STOP, Command, NavigatorOutput
from diff_encoder_sim.robots.description import RobotSource
from diff_encoder_sim.simulation.simulator import Simulator
from diff_encoder_sim.simulation.state import STATES_PERIOD_NS
from diff_encoder_sim.trials.navigating_driver import NavigatingDriver
from diff_encoder_sim.trials.publications import Publications
from diff_encoder_sim.trials.robot_params import RobotParams, imu_of, latency_ns
from diff_encoder_sim.trials.scripted_drive import ScriptedDriver
from diff_encoder_sim.wheels.chain import Chain
from diff_encoder_sim.wheels.odometry import OdometryEstimate, wheel_speeds_mps
from diff_encoder_sim.wheels.report_link import BoundarySampler

WORLD_POSE_IN_MAP = IDENTITY


class Report(NamedTuple):
    """The state of the trial at one report of odometry."""

    stamp_ns: int
    true_pose_in_map: Pose2D  # the newest /world_pose
    odometry: OdometryEstimate  # fused, if the trial has fusion
    estimated_pose_in_map: Optional[Pose2D]  # /global_pose; None before localization
    estimate: Optional[AmclEstimate]  # AMCL's newest
    navigation: NavigatorOutput


def chain_of(trial: Trial, params: RobotParams) -> Chain:
    """Return the encoders and the odometry of a trial."""
    encoder = params.encoder.model_copy(update={'ppr': trial.ppr, 'seed': trial.number})
    return Chain(encoder, params.odometry.model_copy(update={'ppr': trial.ppr}))


def fusion_of(trial: Trial, params: RobotParams) -> Optional[FusedOdometry]:
    """Return the fused odometry of a trial, None without fusion; ConfigError without an IMU."""
    imu, odometry = imu_of(params, trial.fusion), params.odometry.model_copy(update={'ppr': trial.ppr})
    return FusedOdometry(params.fusion, odometry, imu) if imu and trial.fusion != 'none' else None


class LockstepTrial:
    """A robot in its world with its driver.

    A navigated trial has encoders and odometry; a scripted drive does not depend on them, and logs its wheel angles.
    """

    def __init__(
        self, plan: TrialPlan, robot_file: Path, params: RobotParams, publications: Optional[Publications] = None
    ) -> None:
        """Place the robot at its start; without publications nothing is recorded.

        ConfigError if a file is missing or bad, or the trial needs the live graph.
        """
        trial = plan.trial
        if trial.odom != 'encoder' or 'upstream' in (trial.nav, trial.fusion) or plan.slam != 'none':
            given = f'odom {trial.odom}, nav {trial.nav}, fusion {trial.fusion}, slam {plan.slam}'
            allowed = 'encoder; embedded or scripted; none or embedded; none'
            raise ConfigError(f'lockstep: given {given}; allowed: {allowed}')
        start = trial.test.start.pose()
        self._goal = trial.goal()
        self._is_recorded, self._publications = publications is not None, publications or Publications()
        robot = RobotSource(robot_file)
        self._simulator = Simulator(plan.world, robot, params.simulator, start, trial.number, trial.test.floor)
        self._command_latency_ns = latency_ns(params.latency.command)
        # Actions by time, number and arguments; those of the same time run in order of insertion.
        self._delayed: List[Tuple[int, int, Callable[..., None], Tuple[Any, ...]]] = []
        self._numbers = itertools.count()
        self._reports: List[Report] = []  # of this tick
        self._log = array('d')  # of a scripted drive
        self.imu_log: List[Tuple[int, ImuReading]] = []  # of a scripted drive with fusion, with times of arrival
        self._command = STOP
        self._chain: Optional[Chain] = None
        self._fusion = fusion_of(trial, params)
        self._imu_frame = params.simulator.imu.frame if params.simulator.imu else ''
        self.ending = Ending(Outcome.TORN)  # until the trial has ended
        self.true_pose_in_map = start  # the newest /world_pose
        self.distance_m = 0.0  # path length of base_link
        try:
            self._publications.begin(trial, self._simulator, robot_file)
            self.driver: Union[ScriptedDriver, NavigatingDriver]
            joints, encoder = self._simulator.joint_states().names, params.encoder
            sides = ((encoder.left_joint, encoder.left_reversed), (encoder.right_joint, encoder.right_reversed))
            self._wheels = [(joints.index(joint), -1.0 if is_reversed else 1.0) for joint, is_reversed in sides]
            if trial.nav == 'scripted':
                self.driver = ScriptedDriver(trial, self._send)
            else:
                self.driver = NavigatingDriver(
                    plan, params, self._simulator.laser_pose_in_base, self._at, self._send, self._publications
                )
                self._chain = chain_of(trial, params)
                # An ideal encoder needs only the angles at the boundaries of its rate.
                self._boundaries = None if self._chain.encoders.needs_every_angle else BoundarySampler(encoder.rate)
                self._separation_m = params.odometry.wheel_separation
                self._odometry_latency_ns = latency_ns(params.latency.odometry)
            self._has_imu = self._publications.takes_imu or self._fusion is not None
            has_scans = trial.nav != 'scripted' or self._publications.takes_scans  # not used by scripts
            self._scan_period_ns = params.simulator.lidar.period_ns if has_scans else 0
        except BaseException:  # the caller has no object yet to close the physics
            self._simulator.close()
            raise

    @property
    def time_ns(self) -> int:
        """Return the simulated time."""
        return self._simulator.time_ns

    @property
    def log(self) -> np.ndarray:
        """Return (n, 4) the ticks of a scripted drive: wheel angles, rising forward [rad], and command [m/s, rad/s]."""
        return np.array(self._log).reshape(-1, 4)

    def run(self) -> Iterator[Report]:
        """Run to the `ending`, and yield a report at each /odom of a navigated trial."""
        try:
            while self.ending.outcome is Outcome.TORN:
                try:
                    self._tick()
                except RouteFailed as failure:
                    self.ending = failure.ending
                    is_lost = isinstance(self.driver, NavigatingDriver) and self.driver.amcl.is_lost
                    if is_lost and self.ending.outcome is not Outcome.COLLISION:
                        self.ending = Ending(Outcome.LOST, f'localization is lost; {failure}')
                if self._reports:
                    yield from self._reports
                    self._reports.clear()
            self._publications.ending(self._simulator.time_ns, self.ending)
        finally:
            self._simulator.close()
            self._delayed.clear()  # frees maps and filters now; reference cycles would delay it
            del self.driver

    def _tick(self) -> None:
        """Advance by 10 ms: joints, IMU and encoders, true pose, scan, due messages; then the physics."""
        simulator = self._simulator
        now_ns = simulator.time_ns
        if self._is_recorded:
            self._publications.joint_states(simulator.joint_states())
        imu = simulator.imu() if self._has_imu else None
        if imu is not None:
            self._take_imu(now_ns, imu)
        if self._chain is None:
            self._log.extend((*self._wheel_angles_rad(), *self._command))
        else:
            boundaries = self._boundaries
            if boundaries is None or (now_ns >= boundaries.next_ns and boundaries.period_index(now_ns) is not None):
                self._read(self._chain, now_ns)
        if now_ns % STATES_PERIOD_NS == 0:
            self._sample_truth(now_ns)
        if self._scan_period_ns and now_ns % self._scan_period_ns == 0:
            scan = simulator.scan()
            self._publications.scan(scan)
            if isinstance(self.driver, NavigatingDriver):
                self.driver.take_scan(scan)
        delayed = self._delayed
        while delayed and delayed[0][0] <= now_ns:  # actions may add more
            _, _, action, arguments = heapq.heappop(delayed)
            action(*arguments)
        if self.driver.is_over:
            reason = goal_error(self.true_pose_in_map, self._goal)
            self.ending = Ending(Outcome.LOST, reason) if reason else Ending(Outcome.SUCCEEDED)
        else:
            simulator.tick()

    def _wheel_angles_rad(self) -> Tuple[float, float]:
        angles_rad = self._simulator.joint_states().angles_rad
        (left, left_sign), (right, right_sign) = self._wheels
        return left_sign * angles_rad[left], right_sign * angles_rad[right]

    def _take_imu(self, now_ns: int, sample: ImuSample) -> None:
        self._publications.imu(now_ns, sample)
        reading = sample.stamp_ns, self._imu_frame, sample.angular_velocity_radps[2]
        if self._fusion is not None and self._chain is None:
            self.imu_log.append((now_ns, reading))
        elif self._fusion is not None:
            self._send_odometry(now_ns, self._fusion.take_imu(*reading), True)

    def _read(self, chain: Chain, now_ns: int) -> None:
        """Update the encoder, and integrate its reports."""
        for sample, estimate in chain.step(now_ns, *self._wheel_angles_rad()):
            self._publications.encoder_pulse(now_ns, sample)
            if estimate is not None:
                self._send_odometry(now_ns, [estimate], False)
            if self._fusion is not None:
                self._send_odometry(now_ns, self._fusion.take_counts(*sample[:3]), True)

    def _send_odometry(self, now_ns: int, estimates: Sequence[OdometryEstimate], is_fused: bool) -> None:
        due_ns = now_ns + self._odometry_latency_ns
        for estimate in estimates:
            self._at(due_ns, self._take_odometry, due_ns, estimate, is_fused)

    def _take_odometry(self, now_ns: int, estimate: OdometryEstimate, is_fused: bool) -> None:
        self._publications.odometry(now_ns, estimate, is_fused)
        if not is_fused and self._fusion is not None:
            return
        driver = self.driver
        assert isinstance(driver, NavigatingDriver)
        driver.take_odometry(now_ns, estimate)
        estimated = driver.estimated_pose_in_map, driver.amcl.last_estimate, driver.navigation
        self._reports.append(Report(estimate.stamp_ns, self.true_pose_in_map, estimate, *estimated))

    def _sample_truth(self, now_ns: int) -> None:
        """Publish the true pose, and fail a robot that touches an obstacle."""
        # Composed as by world_pose_node, for equal bits.
        pose = WORLD_POSE_IN_MAP.compose(self._simulator.physics.base_pose_in_plane())
        self.distance_m += math.hypot(pose.x_m - self.true_pose_in_map.x_m, pose.y_m - self.true_pose_in_map.y_m)
        self.true_pose_in_map = pose
        self._publications.models(now_ns, self._simulator)
        self._publications.world_pose(now_ns, pose)
        hit = self._simulator.physics.obstacle_hit()
        if hit is not None:
            raise RouteFailed(Outcome.COLLISION, f'the robot touches {hit} at ({pose.x_m:.2f}, {pose.y_m:.2f}) m')
        self.driver.take_time(now_ns)

    def _send(self, now_ns: int, command: Command, is_navigators: bool) -> None:
        self._publications.command(now_ns, command, is_navigators)
        self._at(now_ns + self._command_latency_ns, self._take_command, command)

    def _at(self, time_ns: int, action: Callable[..., None], *arguments: Any) -> None:
        """Run an action at a time."""
        heapq.heappush(self._delayed, (time_ns, next(self._numbers), action, arguments))

    def _take_command(self, command: Command) -> None:
        self._command = command
        self._simulator.command(*command)
        if self._chain is not None:
            # Encoders without direction use the signs of these speeds.
            self._chain.encoders.take_command(*wheel_speeds_mps(*command, self._separation_m))
