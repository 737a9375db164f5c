"""A drive in one process, on simulated time, as far as the encoder does not matter: the robot, its world, its driver.

Equal drives and parameters give equal numbers, bit for bit.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Iterator, List, Optional, Union

from typing_extensions import Protocol

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.drives.trial_definition import Ending, Outcome, RouteFailed, TrialPlan, goal_error
from diff_encoder_sim.navigation.navigator_inputs import Command
from diff_encoder_sim.simulation.simulator import Simulator, SimulatorParams
from diff_encoder_sim.simulation.state import STATES_PERIOD_NS, JointStates
from diff_encoder_sim.trials.navigating_driver import NavigatingDriver
from diff_encoder_sim.trials.publications import Publications
from diff_encoder_sim.trials.robot_params import RobotParams, latency_ns
from diff_encoder_sim.trials.schedule import Driver, Schedule
from diff_encoder_sim.trials.scripted_drive import ScriptedDriver

WORLD_POSE_IN_MAP = IDENTITY


class Wheels(Protocol):
    """What is connected to the wheels of the robot and their controller: a trial's encoder, and all behind it."""

    def take_joints(self, joints: JointStates) -> None:
        """Take a /joint_states, at each tick. Raises RouteFailed."""

    def take_command(self, command: Command) -> None:
        """Take what the wheels' controller takes."""


class LockstepWorld:
    """A robot in its world, with its driver, each part at its rate. The map's frame is the world's."""

    def __init__(
        self, plan: TrialPlan, robot_file: Union[str, Path], params: RobotParams, publications: Publications
    ) -> None:
        """Load the files and place the robot at its start.

        Raises:
            ConfigError: a file is missing or bad, or the trial needs the live graph.
        """
        _check_supported(plan)
        start = plan.trial.test.start.pose()
        self._goal = plan.trial.goal()
        self._publications = publications
        self._simulator = Simulator(plan.world, robot_file, params.simulator, start, plan.trial.number)
        self._command_latency_ns = latency_ns(params.latency.command)
        self._wheels: List[Wheels] = []
        self._ending: Optional[Ending] = None
        self.true_pose_in_map = start  # the newest /world_pose
        self.distance_m = 0.0  # path length of base_link
        self.schedule = self._schedule_at_rates(plan, params.simulator)
        self.driver = self._begin(plan, robot_file, params)

    @property
    def time_ns(self) -> int:
        """Return the simulated time."""
        return self._simulator.time_ns

    @property
    def ending(self) -> Ending:
        """Return how the drive ended, once it was run.

        Raises:
            RuntimeError: it has not ended.
        """
        if self._ending is None:
            raise RuntimeError('the trial has not ended')
        return self._ending

    def connect(self, wheels: Wheels) -> None:
        """Connect what reads the wheels, before time runs."""
        self._wheels.append(wheels)

    def run(self) -> Iterator[None]:
        """Run the drive to its `ending`, and yield after each tick."""
        try:
            while self._ending is None:
                self._tick()
                yield
            self._publications.ending(self._simulator.time_ns, self._ending)
        finally:
            self._simulator.close()
            # Maps and filters are freed now: the parts refer to each other in circles, which Python collects late.
            self.schedule.clear()
            self._wheels.clear()
            del self.driver

    def _tick(self) -> None:
        try:
            self._read_joints()
            self.schedule.run_until(self._simulator.time_ns)
        except RouteFailed as failure:
            self._ending = failure.ending
            return
        if self.driver.is_over:
            reason = goal_error(self.true_pose_in_map, self._goal)
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
            return ScriptedDriver(plan.trial, self._send)
        laser_pose_in_base = self._simulator.laser_pose_in_base
        return NavigatingDriver(plan, params, laser_pose_in_base, self.schedule, self._send, self._publications)

    # ---- at a rate

    def _schedule_at_rates(self, plan: TrialPlan, simulator: SimulatorParams) -> Schedule:
        schedule = Schedule()
        schedule.every(STATES_PERIOD_NS, self._sample_truth)
        if plan.trial.nav != 'scripted' or self._publications.takes_scans:  # a script looks at none
            schedule.every(simulator.lidar.period_ns, self._scan)
        return schedule

    def _read_joints(self) -> None:
        joints = self._simulator.joint_states()
        self._publications.joint_states(joints)
        for wheels in self._wheels:
            wheels.take_joints(joints)

    def _sample_truth(self) -> None:
        """Publish the true pose, and fail a robot that touches an obstacle."""
        now_ns = self._simulator.time_ns
        # Composed as by world_pose_node, for equal bits.
        pose = WORLD_POSE_IN_MAP.compose(self._simulator.base_pose_in_world())
        self.distance_m += math.hypot(pose.x_m - self.true_pose_in_map.x_m, pose.y_m - self.true_pose_in_map.y_m)
        self.true_pose_in_map = pose
        self._publications.models(now_ns, self._simulator)
        self._publications.world_pose(now_ns, pose)
        hit = self._simulator.obstacle_hit()
        if hit is not None:
            raise RouteFailed(Outcome.COLLISION, f'the robot touches {hit} at ({pose.x_m:.2f}, {pose.y_m:.2f}) m')
        self.driver.take_time(now_ns)

    def _scan(self) -> None:
        scan = self._simulator.scan()
        self._publications.scan(scan)
        self.driver.take_scan(scan)

    # ---- after a latency

    def _send(self, now_ns: int, command: Command, is_navigators: bool) -> None:
        self._publications.command(now_ns, command, is_navigators)
        self.schedule.at(now_ns + self._command_latency_ns, lambda: self._take_command(command))

    def _take_command(self, command: Command) -> None:
        self._simulator.command(*command)
        for wheels in self._wheels:
            wheels.take_command(command)


def _check_supported(plan: TrialPlan) -> None:
    trial = plan.trial
    if trial.odom != 'encoder' or trial.nav == 'upstream' or plan.slam != 'none':
        raise ConfigError(
            f'lockstep: given odom {trial.odom}, nav {trial.nav}, slam {plan.slam}; '
            f'allowed: encoder; embedded or scripted; none'
        )
