"""Runs a campaign's trials on an Executor and stores each result immediately."""

from __future__ import annotations

import concurrent.futures
import contextlib
import time
import uuid
from collections import deque
from concurrent.futures import Future
from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

from diff_encoder_sim.base.atomic_files import write_file
from diff_encoder_sim.base.errors import CampaignFault, ConfigError
from diff_encoder_sim.trials.campaign_cells import Campaign, RequestedTrial
from diff_encoder_sim.trials.executors import Workers, WorkersGone
from diff_encoder_sim.trials.progress import Progress
from diff_encoder_sim.trials.results import ResultStore
from diff_encoder_sim.trials.trial_run import FinishedTrial, HostFault, ResultsFolder, RunTrials, run_group, run_trials
from diff_encoder_sim.trials.trial_setup import drive_params

# Limit of open bags per group; all are lost with their worker.
MOST_TOGETHER = 16
# Submitted tasks per worker: one runs, the others are queued.
TASKS_PER_WORKER = 2
TICK_S = 1.0
PROBE_PREFIX = '.probe-'

TrialGroup = Tuple[RequestedTrial, ...]


class UnrunTrial(NamedTuple):
    """A trial without a result."""

    trial: RequestedTrial
    reason: str


def trial_groups(trials: Sequence[RequestedTrial]) -> List[TrialGroup]:
    """Group scripted trials of the same drive, which differ only in encoder and odometry."""
    drives: Dict[Tuple[object, ...], int] = {}  # numbers by test and parameters
    numbers: Dict[str, int] = {}  # of the drive, by the label of the cell
    groups: Dict[Tuple[int, int], List[RequestedTrial]] = {}
    for trial in trials:
        cell = trial.cell
        if trial.campaign.nav != 'scripted':
            groups[trial.position, 0] = [trial]
            continue
        if cell.label not in numbers:
            drive = cell.test.name, *drive_params(cell.robot_params)
            numbers[cell.label] = drives.setdefault(drive, len(drives))
        groups.setdefault((numbers[cell.label], trial.seed), []).append(trial)
    return [
        tuple(group[begin : begin + MOST_TOGETHER])
        for group in groups.values()
        for begin in range(0, len(group), MOST_TOGETHER)
    ]


def run_campaign(
    workers: Workers,
    campaign: Campaign,
    store: ResultStore,
    progress: Progress,
    trials: Sequence[RequestedTrial],
    run: RunTrials = run_trials,
) -> List[UnrunTrial]:
    """Run the pending trials of `store`, and return those that could not be run.

    Raises:
        CampaignFault: no worker can run trials or store their results, or the scheduler is gone.
    """
    with _probe(store.folder) as results:
        engine = _Engine(workers, campaign, store, progress, results, run)
        try:
            unrun = engine.run(trial_groups(trials))
            # One trial killed its worker; the others of its group were lost.
            suspects, engine.suspects = engine.suspects, []
            unrun += engine.run([(trial,) for group in suspects for trial in group], at_once=1)
            return unrun + [UnrunTrial(trial, 'each worker that began it died') for (trial,) in engine.suspects]
        except (WorkersGone, HostFault, ImportError, ConfigError) as error:
            reason = str(error)
        except concurrent.futures.CancelledError:
            reason = 'the scheduler does not answer any more'
        except OSError as error:
            reason = f'{error.filename}: cannot be written: {error.strerror}'
    raise CampaignFault(f'{reason}; {progress.count()} are done; run the same command again to continue')


class _Engine:
    """A sliding window of tasks on the workers."""

    def __init__(
        self,
        workers: Workers,
        campaign: Campaign,
        store: ResultStore,
        progress: Progress,
        results: ResultsFolder,
        run: RunTrials,
    ) -> None:
        self._workers, self._store, self._progress = workers, store, progress
        self._results, self._run = results, run
        self._files = workers.send(campaign.files)
        self._count = 0  # of workers
        self._next_tick_s = 0.0
        self.suspects: List[TrialGroup] = []  # whose worker died

    def run(self, groups: Sequence[TrialGroup], at_once: Optional[int] = None) -> List[UnrunTrial]:
        """Run trials, `at_once` groups at a time or as many as keep all workers busy."""
        unrun: List[UnrunTrial] = []
        waiting = deque(groups)
        running: Dict[Future[List[FinishedTrial]], TrialGroup] = {}
        while waiting or running:
            self._tick()
            while waiting and len(running) < (at_once or max(1, TASKS_PER_WORKER * self._count)):
                group = waiting.popleft()
                running[self._submit(group)] = group
            ended, _ = concurrent.futures.wait(running, TICK_S, concurrent.futures.FIRST_COMPLETED)
            for future in ended:
                group = running.pop(future)
                try:
                    results = future.result()
                except self._workers.lost:
                    self.suspects.append(group)
                except (HostFault, ImportError, concurrent.futures.CancelledError):
                    raise
                except Exception as error:  # a fault of one trial; the others continue
                    self._tick(now=True)  # raises if it is the scheduler's
                    if len(group) == 1:
                        unrun.append(UnrunTrial(group[0], f'{type(error).__name__}: {error}'))
                    else:
                        waiting.extendleft((trial,) for trial in reversed(group))
                else:
                    for finished in results:
                        self._keep(finished)
        return unrun

    def _submit(self, group: TrialGroup) -> Future[List[FinishedTrial]]:
        return self._workers.submit(run_group, self._files, group, self._results, self._run)

    def _keep(self, finished: FinishedTrial) -> None:
        if finished.bag is not None:
            write_file(self._store.folder / finished.row.bag, finished.bag)
        self._store.append(finished.row)
        self._progress.add(finished.row)

    def _tick(self, now: bool = False) -> None:
        """Update the number of workers once per second."""
        if now or time.monotonic() >= self._next_tick_s:
            self._count = self._workers.count()
            self._progress.tick(self._count)
            self._next_tick_s = time.monotonic() + TICK_S


@contextlib.contextmanager
def _probe(folder: Path) -> Iterator[ResultsFolder]:
    """Write a file by which workers detect whether they see the results folder.

    Raises:
        CampaignFault: it cannot be written.
    """
    folder = folder.resolve()
    nonce = uuid.uuid4().hex
    probe = folder / f'{PROBE_PREFIX}{nonce}'
    try:
        for left_by_a_kill in folder.glob(f'{PROBE_PREFIX}*'):
            left_by_a_kill.unlink()
        write_file(probe, nonce.encode('utf-8'))
    except OSError as error:
        raise CampaignFault(f'{error.filename}: cannot be written: {error.strerror}') from None
    try:
        yield ResultsFolder(str(folder), probe.name, nonce)
    finally:
        with contextlib.suppress(OSError):
            probe.unlink()
