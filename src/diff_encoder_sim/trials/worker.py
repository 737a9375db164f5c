"""Trials in a worker process: files in, rows out, bags into the results folder."""

from __future__ import annotations

import os
import platform
import threading
import time
import uuid
from pathlib import Path
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Sequence, Union

from diff_encoder_sim.base.atomic_files import UNFINISHED_SUFFIX
from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.errors import in_one_line
from diff_encoder_sim.drives.trial_definition import TrialPlan
from diff_encoder_sim.trials.campaign_cells import RequestedTrial
from diff_encoder_sim.trials.trial_files import PlacedFiles, TrialFiles
from diff_encoder_sim.trials.trial_setup import TrialSetup
from diff_encoder_sim.trials.trials_csv import BAGS, TrialRow

distributed = deferred('distributed')

# trial_run.run_trials, or a substitute of tests.
RunTrials = Callable[[Sequence[TrialSetup], Path], List[TrialRow]]

# PyBullet is not made for threads: the threads of a worker take turns.
_one_drive = threading.Lock()


class HostFault(Exception):
    """Why the worker's host cannot run trials (a full disk, no memory), in one line."""


class ResultsFolder(NamedTuple):
    """Where the client keeps the results, and how a worker recognises that it sees the same folder."""

    path: str  # absolute, on the client's host
    probe: str  # name of a file in it
    nonce: str  # content of that file

    def is_shared(self) -> bool:
        """Return whether this process sees the client's folder and can write there."""
        try:
            seen = Path(self.path, self.probe).read_text(encoding='utf-8')
        except (OSError, UnicodeDecodeError):
            return False
        return seen == self.nonce and os.access(self.path, os.W_OK)


class FinishedTrial(NamedTuple):
    """The row of a trial, and its bag on the way to the client."""

    row: TrialRow
    bag: Optional[bytes]  # None: not recorded, or already in the results folder


def run_group(
    files: Union[TrialFiles, PlacedFiles], group: Sequence[RequestedTrial], results: ResultsFolder, run: RunTrials
) -> List[FinishedTrial]:
    """Run trials that are one drive of the robot.

    Args:
        files: of the campaign; paths of this host, or contents for the temporary folder of a Dask worker.
        group: the trials.
        results: the client's folder, shared with this host or not.
        run: runs the trials.

    Raises:
        HostFault: a file cannot be written, or the memory is full.
    """
    with _one_drive:
        try:
            if isinstance(files, TrialFiles):
                files = files.materialise(distributed.get_worker().local_directory)
            return _run_group(files, group, results, run)
        except (OSError, MemoryError) as error:
            named = f'{error.filename}: {error.strerror}' if isinstance(error, OSError) and error.filename else ''
            raise HostFault(f'worker on {platform.node()}: {named or in_one_line(error)}') from None


def _run_group(
    files: PlacedFiles, group: Sequence[RequestedTrial], results: ResultsFolder, run: RunTrials
) -> List[FinishedTrial]:
    is_shared = results.is_shared()
    # Another name for each attempt: Dask may restart a trial whose worker is still running it.
    folder = Path(results.path, BAGS) if is_shared else files.robot.parent
    names = [f'.{Path(trial.bag).name}.{uuid.uuid4().hex[:8]}{UNFINISHED_SUFFIX}' for trial in group]
    paths = [folder / name for name in names]
    setups = [_setup(trial, path, files) for trial, path in zip(group, paths)]
    began_s = time.perf_counter()
    rows = run(setups, files.robot)
    wall_time_s = (time.perf_counter() - began_s) / len(group)  # the part of each trial
    finished = []
    for trial, path, row in zip(group, paths, rows):
        content = None
        if trial.bag and is_shared:
            os.replace(str(path), os.path.join(results.path, trial.bag))
        elif trial.bag:
            content = path.read_bytes()
            path.unlink()
        identity: Dict[str, Any] = dict(zip(TrialRow._fields, trial.identity()))
        finished.append(FinishedTrial(row._replace(**identity, wall_time_s=wall_time_s, bag=trial.bag), content))
    return finished


def _setup(trial: RequestedTrial, path: Path, files: PlacedFiles) -> TrialSetup:
    plan = TrialPlan(
        trial=trial.definition(),
        bag=str(path) if trial.bag else '',
        bag_format=trial.campaign.bag_format,
        **files.worlds[trial.cell.test.name]._asdict(),
    )
    return TrialSetup(plan, trial.cell.robot_params, trial.campaign)
