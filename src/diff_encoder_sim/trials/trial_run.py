"""Runs lockstep trials from plans to bags and rows; in worker processes, into the results folder."""

from __future__ import annotations

import gc
import os
import platform
import threading
import time
import uuid
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple

from diff_encoder_sim.base.atomic_files import UNFINISHED_SUFFIX
from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.errors import CampaignFault, in_one_line
from diff_encoder_sim.base.se2 import Pose2D, wrap_angle
from diff_encoder_sim.base.stamps import NANOSECONDS_PER_SECOND
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_bag import TrialBag
from diff_encoder_sim.drives.trial_definition import TrialPlan
from diff_encoder_sim.trials.campaign_cells import RequestedTrial, TrialSetup
from diff_encoder_sim.trials.lockstep_trial import LockstepTrial, Report
from diff_encoder_sim.trials.publications import Publications
from diff_encoder_sim.trials.results import ResultsFolder
from diff_encoder_sim.trials.scripted_trials import run_scripted_trials
from diff_encoder_sim.trials.trial_files import TrialFiles
from diff_encoder_sim.trials.trials_csv import BAGS, TrialRow

distributed = deferred('distributed')


def run_trials(trials: Sequence[TrialSetup], robot_file: Path) -> List[TrialRow]:
    """Run navigated trials, or scripted ones of one drive; each has the same row and bag as if it ran separately."""
    gc.disable()
    try:
        if trials[0].plan.trial.nav == 'scripted':
            drive, reports = run_scripted_trials(trials, robot_file)
            return [_row(setup, drive, last) for setup, last in zip(trials, reports)]
        return [_run_navigated(setup, robot_file) for setup in trials]
    finally:
        gc.enable()


def _run_navigated(setup: TrialSetup, robot_file: Path) -> TrialRow:
    plan, params, options = setup
    last: Optional[Report] = None
    with TrialBag(plan.bag, options.record, plan.bag_format) as bag:
        publications = None
        if options.record != 'none':
            publications = Publications(bag, params, plan.trial.nav)
            publications.trial(plan.trial)
        drive = LockstepTrial(plan, robot_file, params, publications)
        for report in drive.run():
            last = report
    return _row(setup, drive, last)


def _row(setup: TrialSetup, drive: LockstepTrial, last: Optional[Report]) -> TrialRow:
    """Return the row of a trial that ended with this drive and report; None: it ended before the first report."""
    trial, ending = setup.plan.trial, drive.ending
    poses: Dict[PoseSource, Optional[Pose2D]] = dict.fromkeys(PoseSource)
    poses[PoseSource.WORLD] = drive.true_pose_in_map
    if last is not None:
        # Odometry begins at zero, which is the surveyed start pose.
        poses[PoseSource.ODOM] = trial.test.start.pose().compose(last.odometry.base_pose_in_odom)
        poses[PoseSource.AMCL] = last.estimate and last.estimate.base_pose_in_map
        poses[PoseSource.GLOBAL] = last.estimated_pose_in_map
    goal = trial.goal()
    errors = {
        source: pose and Pose2D(pose.x_m - goal.x_m, pose.y_m - goal.y_m, wrap_angle(pose.yaw_rad - goal.yaw_rad))
        for source, pose in poses.items()
    }
    identity = trial.test.name, trial.encoder_label, (), trial.number, trial.number
    duration_s = drive.time_ns / NANOSECONDS_PER_SECOND
    return TrialRow(*identity, ending.outcome, ending.reason, duration_s, errors, drive.distance_m)


# ---- in a worker process

RunTrials = Callable[[Sequence[TrialSetup], Path], List[TrialRow]]  # run_trials, or a substitute of tests
FinishedTrial = Tuple[TrialRow, Optional[bytes]]  # with its bag, unless not recorded, or already in the results folder
_one_drive = threading.Lock()  # PyBullet is not thread-safe: one trial at a time per worker


def run_group(
    files: TrialFiles, group: Sequence[RequestedTrial], results: ResultsFolder, run: RunTrials
) -> List[FinishedTrial]:
    """Run trials of one drive; `files` are of this host, or contents; CampaignFault if a disk or the memory is full."""
    finished, setups, is_shared = [], [], results.is_shared()
    try:
        with _one_drive:
            if files.contents:
                files = files.materialise(distributed.get_worker().local_directory)
            folder = Path(results.path, BAGS) if is_shared else files.robot.parent
            for trial in group:
                # A unique name per attempt: Dask may restart a trial that is still running.
                name = f'.{Path(trial.bag).name}.{uuid.uuid4().hex[:8]}{UNFINISHED_SUFFIX}'
                plan = TrialPlan(
                    trial=trial.definition(),
                    bag=str(folder / name) if trial.bag else '',
                    bag_format=trial.campaign.bag_format,
                    **files.worlds[trial.cell.test.name],
                )
                setups.append(TrialSetup(plan, trial.cell.robot_params, trial.campaign))
            began_s = time.perf_counter()
            rows = run(setups, files.robot)
            wall_time_s = (time.perf_counter() - began_s) / len(group)  # the part of each trial
            for trial, (plan, *_), row in zip(group, setups, rows):
                content = None
                if trial.bag and is_shared:
                    os.replace(plan.bag, Path(results.path, trial.bag))
                elif trial.bag:
                    content = Path(plan.bag).read_bytes()
                    os.unlink(plan.bag)
                identity: Dict[str, Any] = dict(zip(TrialRow._fields, trial.identity()))
                finished.append((row._replace(**identity, wall_time_s=wall_time_s, bag=trial.bag), content))
            return finished
    except (OSError, MemoryError) as error:
        named = f'{error.filename}: {error.strerror}' if isinstance(error, OSError) and error.filename else ''
        raise CampaignFault(f'worker on {platform.node()}: {named or in_one_line(error)}') from None
