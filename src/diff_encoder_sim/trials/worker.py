"""Trials on a Dask worker: their files in, their rows out, their bags into the results folder."""

from __future__ import annotations

import os
import platform
import threading
import time
import uuid
from pathlib import Path
from typing import Callable, List, NamedTuple, Optional, Sequence

from diff_encoder_sim.base.atomic_files import UNFINISHED_SUFFIX
from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.errors import in_one_line
from diff_encoder_sim.drives.topics import RecordMode
from diff_encoder_sim.drives.trial_definition import TrialPlan
from diff_encoder_sim.trials.campaign_cells import Campaign, TrialJob
from diff_encoder_sim.trials.results import TrialRow
from diff_encoder_sim.trials.trial_files import PlacedFiles
from diff_encoder_sim.trials.trial_run import TrialResult
from diff_encoder_sim.trials.trial_setup import TrialSetup

distributed = deferred('distributed')

# lockstep.trial_run.run_trials, or a substitute of tests.
RunTrials = Callable[[Sequence[TrialSetup], Path, RecordMode], List[TrialResult]]

# PyBullet is not made for threads: a worker that has several takes turns.
_one_drive = threading.Lock()


class HostFault(Exception):
    """Why the worker's host cannot run trials (a full disk, no memory), in one line."""


class ResultsFolder(NamedTuple):
    """Where the client keeps the results, and how a worker recognises that it sees the same folder."""

    path: str  # absolute, on the client's host
    probe: str  # name of a file in it
    nonce: str  # content of that file

    def is_shared(self) -> bool:
        """Check whether this process sees the client's folder and can write there."""
        try:
            seen = Path(self.path, self.probe).read_text(encoding='utf-8')
        except (OSError, UnicodeDecodeError):
            return False
        return seen == self.nonce and os.access(self.path, os.W_OK)


class PlacedJob(NamedTuple):
    """A trial and where its bag goes."""

    job: TrialJob
    bag: str  # path below the results folder; '' for none


class FinishedTrial(NamedTuple):
    """What a worker returns to the client."""

    row: TrialRow
    bag: Optional[bytes]  # None: not recorded, or in its place already


def run_task(
    campaign: Campaign, groups: Sequence[Sequence[PlacedJob]], results: ResultsFolder, run: RunTrials
) -> List[FinishedTrial]:
    """Run `run_jobs` for each group with the worker's own temporary folder, which is removed with the worker.

    Raises:
        HostFault: a file cannot be written, or the memory is full.
    """
    with _one_drive:
        scratch = Path(distributed.get_worker().local_directory)
        try:
            return [finished for group in groups for finished in run_jobs(campaign, group, results, run, scratch)]
        except (OSError, MemoryError) as error:
            raise HostFault(f'worker on {platform.node()}: {_reason(error)}') from None


def run_jobs(
    campaign: Campaign, group: Sequence[PlacedJob], results: ResultsFolder, run: RunTrials, scratch: Path
) -> List[FinishedTrial]:
    """Run trials that are one drive of the robot.

    Args:
        campaign: which they belong to.
        group: what to run.
        results: the client's folder, shared with this host or not.
        run: runs the trials.
        scratch: a folder of this process for temporary files.

    Raises:
        OSError: a file cannot be written.
    """
    is_shared = results.is_shared()
    files = campaign.files.materialise(scratch)
    paths = [_unfinished(placed, results, scratch, is_shared) for placed in group]
    setups = [_setup(campaign, placed, path, files) for placed, path in zip(group, paths)]
    began_s = time.perf_counter()
    ended = run(setups, files.robot, campaign.params.record)
    wall_time_s = (time.perf_counter() - began_s) / len(group)  # of each trial, its part of what they took together
    finished = []
    for placed, path, result in zip(group, paths, ended):
        if placed.bag and is_shared:
            os.replace(str(path), str(Path(results.path, placed.bag)))
        row = _row(campaign, placed, result, wall_time_s)
        finished.append(FinishedTrial(row, _take(path) if placed.bag and not is_shared else None))
    return finished


def _unfinished(placed: PlacedJob, results: ResultsFolder, scratch: Path, is_shared: bool) -> Path:
    bag = Path(results.path, placed.bag)
    # A name of its own for each attempt: Dask may restart a trial whose worker is still running it.
    return (bag.parent if is_shared else scratch) / f'.{bag.name}.{uuid.uuid4().hex[:8]}{UNFINISHED_SUFFIX}'


def _setup(campaign: Campaign, placed: PlacedJob, path: Path, files: PlacedFiles) -> TrialSetup:
    cell = campaign.cells[placed.job.cell_index]
    world = files.worlds[cell.test.name]
    plan = TrialPlan(
        trial=campaign.trial_of(placed.job),
        world=world.world,
        map=world.map,
        bag=str(path) if placed.bag else '',
        bag_format=campaign.params.bag_format,
    )
    return TrialSetup(plan, cell.robot_params)


def _row(campaign: Campaign, placed: PlacedJob, result: TrialResult, wall_time_s: float) -> TrialRow:
    job, cell = placed.job, campaign.cells[placed.job.cell_index]
    return TrialRow(
        cell.test.name,
        cell.encoder.label,
        cell.varied_texts(),
        job.trial,
        job.seed,
        result.ending.outcome,
        result.ending.reason,
        result.duration_s,
        result.errors,
        result.distance_m,
        wall_time_s,
        placed.bag,
    )


def _take(path: Path) -> bytes:
    content = path.read_bytes()
    path.unlink()
    return content


def _reason(error: BaseException) -> str:
    if isinstance(error, OSError) and error.filename:
        return f'{error.filename}: {error.strerror}'
    return in_one_line(error)
