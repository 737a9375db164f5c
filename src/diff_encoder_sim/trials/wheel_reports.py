"""A trial's encoder in lockstep, and what follows from its reports: odometry, and whoever listens to it."""

from __future__ import annotations

from typing import List, NamedTuple, Optional

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.trial_definition import Trial
from diff_encoder_sim.localization.amcl import AmclEstimate
from diff_encoder_sim.navigation.navigator_inputs import Command, NavigatorOutput
from diff_encoder_sim.simulation.state import JointStates
from diff_encoder_sim.trials.latency import latency_ns
from diff_encoder_sim.trials.lockstep_world import LockstepWorld
from diff_encoder_sim.trials.navigating_driver import NavigatingDriver
from diff_encoder_sim.trials.odometry_listener import OdometryListener, SurveyedStart
from diff_encoder_sim.trials.publications import Publications
from diff_encoder_sim.trials.robot_params import RobotParams
from diff_encoder_sim.wheels.odometry import OdometryEstimate, WheelOdometry, wheel_speeds_mps
from diff_encoder_sim.wheels.report_link import EncoderSample
from diff_encoder_sim.wheels.sampling import BoundarySampler
from diff_encoder_sim.wheels.wheel_encoder import ReportingEncoder


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
