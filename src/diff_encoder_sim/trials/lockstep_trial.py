"""A trial in one process, on simulated time: the parts of the live graph, each at its rate."""

from __future__ import annotations

from pathlib import Path
from typing import Iterator, Optional, Sequence, Union

from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.trial_definition import Ending, TrialPlan
from diff_encoder_sim.trials.lockstep_world import LockstepWorld
from diff_encoder_sim.trials.publications import Publications
from diff_encoder_sim.trials.robot_params import RobotParams
from diff_encoder_sim.trials.trial_setup import TrialSetup
from diff_encoder_sim.trials.wheel_reports import Report, WheelReports


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
        plan, params = trials[0]
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
