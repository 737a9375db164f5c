"""A trial in one process, on simulated time: the parts of the live graph, each at its rate."""

from __future__ import annotations

from pathlib import Path
from typing import Iterator, List, NamedTuple, Optional, Sequence, Union

from typing_extensions import Protocol

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.trial_definition import Ending, Trial, TrialPlan
from diff_encoder_sim.localization.amcl import AmclEstimate
from diff_encoder_sim.navigation.navigator_inputs import Command, NavigatorOutput
from diff_encoder_sim.simulation.state import JointStates
from diff_encoder_sim.trials.lockstep_world import LockstepWorld
from diff_encoder_sim.trials.navigating_driver import NavigatingDriver
from diff_encoder_sim.trials.publications import Publications
from diff_encoder_sim.trials.robot_params import RobotParams, latency_ns
from diff_encoder_sim.trials.schedule import NO_NAVIGATION
from diff_encoder_sim.trials.trial_setup import TrialSetup
from diff_encoder_sim.wheels.odometry import OdometryEstimate, WheelOdometry, wheel_speeds_mps
from diff_encoder_sim.wheels.report_link import EncoderSample
from diff_encoder_sim.wheels.sampling import BoundarySampler
from diff_encoder_sim.wheels.wheel_encoder import ReportingEncoder


class OdometryListener(Protocol):
    """Takes a trial's odometry, and knows by it where the robot is."""

    @property
    def estimate(self) -> Optional[AmclEstimate]:
        """Return AMCL's newest estimate, None without one."""

    @property
    def estimated_pose_in_map(self) -> Optional[Pose2D]:
        """Return the newest /global_pose, None before the first."""

    @property
    def navigation(self) -> NavigatorOutput:
        """Return the navigator's newest output."""

    def take_odometry(self, now_ns: int, estimate: OdometryEstimate) -> None:
        """Act on an /odom. Raises RouteFailed."""


class SurveyedStart:
    """Places odometry, which begins there, at the surveyed start pose, as scripted_drive_node's transform does."""

    estimate = None
    navigation = NO_NAVIGATION

    def __init__(self, start_pose_in_map: Pose2D, publications: Publications) -> None:
        self._start_pose_in_map, self._publications = start_pose_in_map, publications
        self.estimated_pose_in_map: Optional[Pose2D] = None

    def take_odometry(self, now_ns: int, estimate: OdometryEstimate) -> None:
        """Publish it as /global_pose."""
        self.estimated_pose_in_map = self._start_pose_in_map.compose(estimate.base_pose_in_odom)
        self._publications.global_pose(now_ns, estimate.stamp_ns, self.estimated_pose_in_map)


class Report(NamedTuple):
    """The state of the trial at one /odom."""

    stamp_ns: int
    true_pose_in_map: Pose2D  # the newest /world_pose
    odometry: OdometryEstimate
    estimated_pose_in_map: Optional[Pose2D]  # /global_pose; None before localization
    estimate: Optional[AmclEstimate]  # AMCL's newest
    navigation: NavigatorOutput


class WheelReports:
    """One trial's encoder and odometry, on the wheels of a world that other trials may share."""

    def __init__(self, trial: Trial, params: RobotParams, world: LockstepWorld, publications: Publications) -> None:
        """Connect to the wheels.

        Args:
            trial: with this encoder.
            params: of the trial; of the world's only the latency of odometry counts.
            world: which is driven as the trial says; where it is navigated, by this odometry.
            publications: of what this encoder changes.
        """
        self._world, self._publications = world, publications
        self._encoder = ReportingEncoder(params.encoder.model_copy(update={'ppr': trial.ppr, 'seed': trial.number}))
        # Joint states come in order and with both wheels: of an ideal encoder the others would change nothing.
        self._boundaries = None if self._encoder.needs_every_angle else BoundarySampler(params.encoder.rate)
        self._odometry = WheelOdometry(params.odometry.model_copy(update={'ppr': trial.ppr}))
        self._latency_ns = latency_ns(params.latency.odometry)
        self._listener = _listener(trial, world, publications)
        self.reports: List[Report] = []  # since the newest joint states
        self.last_report: Optional[Report] = None
        world.connect(self)

    def take_joints(self, joints: JointStates) -> None:
        """Count, and integrate the counts that are reported."""
        self.reports.clear()
        boundaries, now_ns = self._boundaries, joints.stamp_ns
        if boundaries is not None and (now_ns < boundaries.next_ns or boundaries.period_index(now_ns) is None):
            return
        for sample in self._encoder.update(now_ns, joints.names, joints.angles_rad):
            self._take_sample(now_ns, sample)

    def take_command(self, command: Command) -> None:
        """Take the signs of speeds, for an encoder that does not know its own direction."""
        self._encoder.take_command(*wheel_speeds_mps(*command, self._odometry.params.wheel_separation))

    def _take_sample(self, now_ns: int, sample: EncoderSample) -> None:
        self._publications.encoder_pulse(now_ns, sample)
        estimate = self._odometry.update(*sample)
        if estimate is not None:
            due_ns = now_ns + self._latency_ns
            self._world.schedule.at(due_ns, lambda: self._take_odometry(due_ns, estimate))

    def _take_odometry(self, now_ns: int, estimate: OdometryEstimate) -> None:
        self._publications.odometry(now_ns, estimate)
        listener = self._listener
        listener.take_odometry(now_ns, estimate)
        self.last_report = Report(
            estimate.stamp_ns,
            self._world.true_pose_in_map,
            estimate,
            listener.estimated_pose_in_map,
            listener.estimate,
            listener.navigation,
        )
        self.reports.append(self.last_report)


def _listener(trial: Trial, world: LockstepWorld, publications: Publications) -> OdometryListener:
    if isinstance(world.driver, NavigatingDriver):
        return world.driver
    return SurveyedStart(trial.test.start.pose(), publications)


class LockstepTrials:
    """Trials that are one drive of the robot: one alone, or scripted ones which differ behind the wheels."""

    def __init__(
        self,
        trials: Sequence[TrialSetup],
        robot_file: Union[str, Path],
        own: Sequence[Publications],
        common: Publications,
    ) -> None:
        """Load the files and place the robot at its start.

        Args:
            trials: of equal `drive`.
            robot_file: of all.
            own: publications of each trial, for what its encoder changes.
            common: publications of all trials, for the rest.

        Raises:
            ConfigError: a file is missing or bad, or a trial needs the live graph.
            ValueError: the trials are not one drive.
        """
        _check_one_drive(trials)
        plan, params, _ = trials[0]
        for trial, publications in zip(trials, own):
            publications.trial(trial.plan.trial)
        self.world = LockstepWorld(plan, robot_file, params, common)
        self.wheels = [
            WheelReports(trial.plan.trial, trial.params, self.world, publications)
            for trial, publications in zip(trials, own)
        ]


class LockstepTrial:
    """A trial that is a drive of its own."""

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
        publications = publications or Publications()
        alone = LockstepTrials([TrialSetup(plan, params)], robot_file, [publications], publications)
        self._world, (self._wheels,) = alone.world, alone.wheels

    @property
    def time_ns(self) -> int:
        """Return the simulated time."""
        return self._world.time_ns

    @property
    def ending(self) -> Ending:
        """Return how the trial ended, once it was run.

        Raises:
            RuntimeError: it has not ended.
        """
        return self._world.ending

    @property
    def distance_m(self) -> float:
        """Return the path length of base_link."""
        return self._world.distance_m

    @property
    def true_pose_in_map(self) -> Pose2D:
        """Return the newest /world_pose."""
        return self._world.true_pose_in_map

    @property
    def last_report(self) -> Optional[Report]:
        """Return the report of the newest /odom, None before the first."""
        return self._wheels.last_report

    def run(self) -> Iterator[Report]:
        """Run the trial to its `ending`, and yield a report at each /odom."""
        for _ in self._world.run():
            yield from self._wheels.reports


def _check_one_drive(trials: Sequence[TrialSetup]) -> None:
    first, *others = trials
    if others and (first.plan.trial.nav != 'scripted' or any(other.drive() != first.drive() for other in others)):
        raise ValueError('given trials that are different drives; expected scripted ones that differ in encoders')
