"""A trial in lockstep, from its plan to its bag and its result."""

from __future__ import annotations

from pathlib import Path
from typing import Dict, NamedTuple, Optional, Union

from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.lockstep.bag_publications import BagPublications
from diff_encoder_sim.lockstep.lockstep_trial import LockstepTrial
from diff_encoder_sim.lockstep.robot_params import RobotParams
from diff_encoder_sim.recording.topics import RecordMode
from diff_encoder_sim.recording.trial_bag import TrialBag
from diff_encoder_sim.trials.pose_source import PoseSource
from diff_encoder_sim.trials.trial_definition import TrialPlan
from diff_encoder_sim.trials.trial_outcome import Ending, FinalErrors


class TrialResult(NamedTuple):
    """How a trial ended, and how far from its goal by each pose source."""

    ending: Ending
    duration_s: float  # simulated
    distance_m: float  # path length of base_link
    errors: FinalErrors


def run_trial(plan: TrialPlan, robot_file: Union[str, Path], params: RobotParams, record: RecordMode) -> TrialResult:
    """Run a trial and, unless `record` is none, write its bag to `plan.bag`: whole, or not at all.

    Raises:
        ConfigError: a file is missing or bad.
        OSError: the bag cannot be written.
    """
    if record == 'none':
        return _run(LockstepTrial(plan, robot_file, params), plan)
    with TrialBag(plan.bag, record, plan.bag_format) as bag:
        return _run(LockstepTrial(plan, robot_file, params, BagPublications(bag, params)), plan)


def _run(trial: LockstepTrial, plan: TrialPlan) -> TrialResult:
    for _ in trial.run():
        pass
    return TrialResult(
        trial.ending, trial.time_ns / NANOSECONDS_PER_SECOND, trial.distance_m, final_errors(trial, plan)
    )


def final_errors(trial: LockstepTrial, plan: TrialPlan) -> FinalErrors:
    """Return how far the trial ended from its goal by each pose source, in the axes of the map."""
    last, start = trial.last_report, plan.trial.test.start.pose()
    poses: Dict[PoseSource, Optional[Pose2D]] = dict.fromkeys(PoseSource)
    poses[PoseSource.WORLD] = trial.true_pose_in_map
    if last is not None:
        # Odometry begins at zero, which is the surveyed start pose.
        poses[PoseSource.ODOM] = start.compose(last.odometry.base_pose_in_odom)
        poses[PoseSource.AMCL] = last.estimate and last.estimate.base_pose_in_map
        poses[PoseSource.GLOBAL] = last.estimated_pose_in_map
    goal = plan.trial.goal()
    return {
        source: pose and Pose2D(pose.x_m - goal.x_m, pose.y_m - goal.y_m, wrap_angle(pose.yaw_rad - goal.yaw_rad))
        for source, pose in poses.items()
    }
