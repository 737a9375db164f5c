"""Trials in lockstep, from their plans to their bags and rows."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Dict, List, Optional, Sequence, Union

from diff_encoder_sim.base.processes import without_collection
from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.topics import PoseSource, RecordMode
from diff_encoder_sim.drives.trial_bag import TrialBag, TrialBags
from diff_encoder_sim.drives.trial_definition import FinalErrors, Trial, TrialPlan
from diff_encoder_sim.trials.lockstep_trial import LockstepTrial, Report
from diff_encoder_sim.trials.publications import Publications
from diff_encoder_sim.trials.robot_params import RobotParams
from diff_encoder_sim.trials.trial_setup import LockstepOptions, TrialSetup
from diff_encoder_sim.trials.trials_csv import TrialRow


def run_trial(plan: TrialPlan, robot_file: Union[str, Path], params: RobotParams, record: RecordMode) -> TrialRow:
    """Run a trial and, unless `record` is none, write its bag to `plan.bag`: whole, or not at all.

    Raises:
        ConfigError: a file is missing or bad.
        OSError: the bag cannot be written.
    """
    return run_trials([TrialSetup(plan, params, LockstepOptions(record=record))], robot_file)[0]


def run_trials(trials: Sequence[TrialSetup], robot_file: Union[str, Path]) -> List[TrialRow]:
    """Run trials of equal `drive` at once; each has the same row and bag as if it ran separately.

    Raises:
        ConfigError: a file is missing or bad.
        OSError: a bag cannot be written.
        ValueError: the trials are not one drive.
    """
    plan, params, options = trials[0]
    nav = plan.trial.nav
    with contextlib.ExitStack() as opened:
        own: List[Publications] = [Publications() for _ in trials]
        common: Optional[Publications] = None
        if options.record != 'none':
            bags = [opened.enter_context(TrialBag(each.bag, options.record, each.bag_format)) for each, *_ in trials]
            own = [Publications(bag, each.params, nav) for bag, each in zip(bags, trials)]
            # A navigated trial has one bag, and needs no loop over bags.
            common = own[0] if len(bags) == 1 else Publications(TrialBags(bags), params, nav)
        drive = LockstepTrial(plan, robot_file, params, common, list(zip(trials, own)))
        with without_collection():
            for _ in drive.run():
                pass
    return [
        TrialRow(
            trial.test.name,
            trial.encoder_label,
            (),
            trial.number,
            trial.number,
            drive.ending.outcome,
            drive.ending.reason,
            drive.time_ns / NANOSECONDS_PER_SECOND,
            final_errors(trial, drive.true_pose_in_map, wheels.last_report),
            drive.distance_m,
        )
        for trial, wheels in zip((setup.plan.trial for setup in trials), drive.wheels)
    ]


def final_errors(trial: Trial, true_pose_in_map: Pose2D, last: Optional[Report]) -> FinalErrors:
    """Return how far a trial ended from its goal by each pose source, in the axes of the map.

    Args:
        trial: which has ended.
        true_pose_in_map: there.
        last: its last report, None if it ended before the first.
    """
    poses: Dict[PoseSource, Optional[Pose2D]] = dict.fromkeys(PoseSource)
    poses[PoseSource.WORLD] = true_pose_in_map
    if last is not None:
        # Odometry begins at zero, which is the surveyed start pose.
        poses[PoseSource.ODOM] = trial.test.start.pose().compose(last.odometry.base_pose_in_odom)
        poses[PoseSource.AMCL] = last.estimate and last.estimate.base_pose_in_map
        poses[PoseSource.GLOBAL] = last.estimated_pose_in_map
    goal = trial.goal()
    return {
        source: pose and Pose2D(pose.x_m - goal.x_m, pose.y_m - goal.y_m, wrap_angle(pose.yaw_rad - goal.yaw_rad))
        for source, pose in poses.items()
    }
