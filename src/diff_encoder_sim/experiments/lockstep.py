"""A navigated trial in one process, on simulated time: the live graph's parts, ticked in order.

Equal trials and parameters give equal numbers, bit for bit.
"""
from __future__ import annotations

from pathlib import Path
from typing import Iterator, NamedTuple, Optional, Tuple, Union

from diff_encoder_sim.encoder import DiffEncoder
from diff_encoder_sim.experiments.definition import TrialPlan
from diff_encoder_sim.experiments.robot_params import RobotParams
from diff_encoder_sim.experiments.route_driver import RouteDriver
from diff_encoder_sim.localization.amcl import Amcl, AmclEstimate
from diff_encoder_sim.mapping.map_files import load_map
from diff_encoder_sim.navigation.navigator import Navigator
from diff_encoder_sim.navigation.outcome import Command, GoalStatus, NavigatorOutput
from diff_encoder_sim.odometry import OdometryEstimate, WheelOdometry
from diff_encoder_sim.scan import Scan
from diff_encoder_sim.se2 import Pose2D
from diff_encoder_sim.seeds import generator
from diff_encoder_sim.simulation.simulator import Simulator
from diff_encoder_sim.timeline import NANOSECONDS_PER_SECOND

# From an odometry message to the moment when the command that answers it moves the wheels: as the
# live simulator's command gate has it.
COMMAND_DELAY_NS = 20_000_000


class Report(NamedTuple):
    """The robot at one message of its odometry."""

    stamp_ns: int
    true_pose_in_map: Pose2D
    odometry: OdometryEstimate
    believed_pose_in_map: Optional[Pose2D]     # /global_pose; None before localization
    estimate: Optional[AmclEstimate]           # the newest of AMCL's
    navigation: NavigatorOutput


class LockstepTrial:
    """One robot, its sensors and its navigation; `run` yields a report each 50 ms."""

    def __init__(self, plan: TrialPlan, robot_file: Union[str, Path], params: RobotParams) -> None:
        trial = plan.trial
        start = trial.test.start
        self._simulator = Simulator(plan.world, robot_file, params.simulator, start.pose(),
                                    trial.number)
        self._encoder = DiffEncoder(params.encoder.model_copy(update={'ppr': trial.ppr}))
        self._odometry = WheelOdometry(params.odometry.model_copy(update={'ppr': trial.ppr}))
        grid = load_map(plan.map)
        at_start = {'initial_pose_x': start.x, 'initial_pose_y': start.y,
                    'initial_pose_a': start.yaw}
        self._amcl = Amcl(params.amcl.model_copy(update=at_start), grid,
                          generator(trial.number, 'amcl'))
        self._tolerance_ns = round(params.amcl.transform_tolerance * NANOSECONDS_PER_SECOND)
        self._laser_pose = self._simulator.laser_pose_in_base
        self._navigator = Navigator(params.navigator, grid, self._laser_pose)
        self._driver = RouteDriver(trial.test)
        self._scan_period_ns = round(NANOSECONDS_PER_SECOND / params.simulator.lidar.rate)
        self._odom_pose_in_map: Optional[Pose2D] = None         # as /tf has it
        self._command: Optional[Tuple[int, Command]] = None    # and when it takes effect

    def run(self) -> Iterator[Report]:
        """Drive the route; ends when the robot rests at its end.

        Raises:
            RouteFailed: it did not get there.
        """
        try:
            while not self._driver.is_over:
                report = self._tick()
                if report is not None:
                    yield report
        finally:
            self._simulator.close()

    def _tick(self) -> Optional[Report]:
        simulator = self._simulator
        odometry = self._read_wheels()
        if simulator.time_ns % self._scan_period_ns == 0:
            scan = simulator.scan()
            self._navigator.take_scan(scan)
        report = self._control(odometry) if odometry is not None else None
        # After control: a live AMCL is at work while the navigator decides.
        if simulator.time_ns % self._scan_period_ns == 0 and odometry is not None:
            self._localize(odometry, scan)
        if self._command is not None and self._command[0] == simulator.time_ns:
            simulator.command(*self._command[1])
        simulator.tick()
        return report

    def _localize(self, odometry: OdometryEstimate, scan: Scan) -> None:
        self._amcl.update(odometry.base_pose_in_odom, scan, self._laser_pose)
        if not self._amcl.is_lost:
            self._odom_pose_in_map = self._amcl.odom_pose_in_map
            self._navigator.take_localization(scan.stamp_ns + self._tolerance_ns,
                                              self._odom_pose_in_map)

    def _read_wheels(self) -> Optional[OdometryEstimate]:
        joints = self._simulator.joint_states()
        sample = self._encoder.update(*joints[:3])
        return None if sample is None else self._odometry.update(*sample)

    def _control(self, odometry: OdometryEstimate) -> Report:
        stamp_ns = odometry.stamp_ns
        self._navigator.take_odometry(stamp_ns, odometry.base_pose_in_odom,
                                      odometry.linear_velocity_mps,
                                      odometry.angular_velocity_radps, *odometry.twist_std())
        was_active = self._navigator.status is GoalStatus.ACTIVE
        output = self._navigator.step(stamp_ns)
        if was_active:
            self._send(output.command)
        believed = None
        if self._odom_pose_in_map is not None:
            believed = self._odom_pose_in_map.compose(odometry.base_pose_in_odom)
            self._drive_on(stamp_ns, believed, output)
        return Report(stamp_ns, self._simulator.base_pose_in_world(), odometry, believed,
                      self._amcl.last_estimate, output)

    def _drive_on(self, stamp_ns: int, believed: Pose2D, output: NavigatorOutput) -> None:
        wanted = self._driver.step(stamp_ns, believed, output.status, output.text)
        if wanted.goal_in_map is not None:
            self._navigator.set_goal(wanted.goal_in_map)
        if wanted.turn_rate_radps is not None:
            self._send(Command(0.0, wanted.turn_rate_radps))

    def _send(self, command: Command) -> None:
        self._command = self._simulator.time_ns + COMMAND_DELAY_NS, command
