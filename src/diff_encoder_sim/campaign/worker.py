"""One trial on a Dask worker: its files in, its row out, its bag into the results folder."""

from __future__ import annotations

import os
import platform
import threading
import time
import uuid
from pathlib import Path
from typing import Callable, NamedTuple, Optional

from diff_encoder_sim.base.atomic_files import UNFINISHED_SUFFIX
from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.errors import in_one_line
from diff_encoder_sim.campaign.campaign_definition import Campaign, TrialJob
from diff_encoder_sim.campaign.trial_row import TrialRow
from diff_encoder_sim.lockstep.robot_params import RobotParams
from diff_encoder_sim.lockstep.trial_run import TrialResult
from diff_encoder_sim.recording.topics import RecordMode
from diff_encoder_sim.trials.trial_definition import TrialPlan

distributed = deferred('distributed')

# lockstep.trial_run.run_trial, or a substitute of tests.
RunTrial = Callable[[TrialPlan, Path, RobotParams, RecordMode], TrialResult]

# PyBullet is not made for threads: a worker that has several takes turns.
_one_trial = threading.Lock()


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


class FinishedTrial(NamedTuple):
    """What a worker returns to the client."""

    row: TrialRow
    bag: Optional[bytes]  # None: not recorded, or in its place already


def run_task(campaign: Campaign, job: TrialJob, bag: str, results: ResultsFolder, run: RunTrial) -> FinishedTrial:
    """Run `run_job` with the worker's own temporary folder, which is removed with the worker.

    Raises:
        HostFault: a file cannot be written, or the memory is full.
    """
    with _one_trial:
        try:
            return run_job(campaign, job, bag, results, run, Path(distributed.get_worker().local_directory))
        except (OSError, MemoryError) as error:
            raise HostFault(f'worker on {platform.node()}: {_reason(error)}') from None


def run_job(
    campaign: Campaign, job: TrialJob, bag: str, results: ResultsFolder, run: RunTrial, scratch: Path
) -> FinishedTrial:
    """Run one trial.

    Args:
        campaign: which the job belongs to.
        job: what to run.
        results: the client's folder, shared with this host or not.
        run: runs the trial.
        bag: path of its bag below the results folder; '' for none.
        scratch: a folder of this process for temporary files.

    Raises:
        OSError: a file cannot be written.
    """
    is_shared = results.is_shared()
    placed = Path(results.path, bag)
    # A name of its own for each attempt: Dask may restart a trial whose worker is still running it.
    unfinished = (placed.parent if is_shared else scratch) / (
        f'.{placed.name}.{uuid.uuid4().hex[:8]}{UNFINISHED_SUFFIX}'
    )
    row = _run(campaign, job, bag, unfinished, run, scratch)
    if bag and is_shared:
        os.replace(str(unfinished), str(placed))
    return FinishedTrial(row, _take(unfinished) if bag and not is_shared else None)


def _run(campaign: Campaign, job: TrialJob, bag: str, bag_path: Path, run: RunTrial, scratch: Path) -> TrialRow:
    cell = campaign.cells[job.cell_index]
    files = campaign.files.materialise(scratch)
    world = files.worlds[cell.test.name]
    plan = TrialPlan(
        trial=campaign.trial_of(job),
        world=world.world,
        map=world.map,
        bag=str(bag_path) if bag else '',
        bag_format=campaign.params.bag_format,
    )
    began_s = time.perf_counter()
    result = run(plan, files.robot, cell.robot_params, campaign.params.record)
    wall_time_s = time.perf_counter() - began_s
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
        bag,
    )


def _take(path: Path) -> bytes:
    content = path.read_bytes()
    path.unlink()
    return content


def _reason(error: BaseException) -> str:
    if isinstance(error, OSError) and error.filename:
        return f'{error.filename}: {error.strerror}'
    return in_one_line(error)
