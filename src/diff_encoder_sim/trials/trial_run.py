"""Trials in lockstep, from their plans to their bags and their results."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Dict, List, Optional, Sequence, Tuple, Union

from diff_encoder_sim.base.processes import without_collection
from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.topics import PoseSource, RecordMode
from diff_encoder_sim.drives.trial_bag import TrialBag, TrialBags
from diff_encoder_sim.drives.trial_definition import FinalErrors, Trial, TrialPlan
from diff_encoder_sim.trials.lockstep_trial import LockstepTrials, Report
from diff_encoder_sim.trials.publications import BagPublications, Publications
from diff_encoder_sim.trials.results import TrialRow
from diff_encoder_sim.trials.robot_params import RobotParams
from diff_encoder_sim.trials.trial_setup import TrialOptions, TrialSetup


def run_trial(plan: TrialPlan, robot_file: Union[str, Path], params: RobotParams, record: RecordMode) -> TrialRow:
    """Run a trial and, unless `record` is none, write its bag to `plan.bag`: whole, or not at all.

    Raises:
        ConfigError: a file is missing or bad.
        OSError: the bag cannot be written.
    """
    return run_trials([TrialSetup(plan, params, TrialOptions(record=record))], robot_file)[0]


def run_trials(trials: Sequence[TrialSetup], robot_file: Union[str, Path]) -> List[TrialRow]:
    """Run trials of equal `drive` at once, each with the result and the bag that it has alone.

    Raises:
        ConfigError: a file is missing or bad.
        OSError: a bag cannot be written.
        ValueError: the trials are not one drive.
    """
    with contextlib.ExitStack() as opened:
        together = LockstepTrials(trials, robot_file, *_publications(trials, opened))
        world = together.world
        with without_collection():
            for _ in world.run():
                pass
    return [
        TrialRow(
            trial.test.name,
            trial.encoder_label,
            (),
            trial.number,
            trial.number,
            world.ending.outcome,
            world.ending.reason,
            world.time_ns / NANOSECONDS_PER_SECOND,
            final_errors(trial, world.true_pose_in_map, wheels.last_report),
            world.distance_m,
        )
        for trial, wheels in zip((plan.trial for plan, *_ in trials), together.wheels)
    ]


def _publications(
    trials: Sequence[TrialSetup], opened: contextlib.ExitStack
) -> Tuple[List[Publications], Publications]:
    """Return those of each trial, and those of all."""
    record = trials[0].options.record
    if record == 'none':
        return [Publications()] * len(trials), Publications()
    bags = [opened.enter_context(TrialBag(plan.bag, record, plan.bag_format)) for plan, *_ in trials]
    own: List[Publications] = [
        BagPublications(bag, params, plan.trial.nav) for bag, (plan, params, _) in zip(bags, trials)
    ]
    plan, params, _ = trials[0]
    # A navigated trial has one bag, and needs no loop over bags.
    return own, own[0] if len(bags) == 1 else BagPublications(TrialBags(bags), params, plan.trial.nav)


def final_errors(trial: Trial, true_pose_in_map: Pose2D, last: Optional[Report]) -> FinalErrors:
    """Return how far a trial ended from its goal by each pose source, in the axes of the map.

    Args:
        trial: which has ended.
        true_pose_in_map: there.
        last: its last report, None where it ended before the first.
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
