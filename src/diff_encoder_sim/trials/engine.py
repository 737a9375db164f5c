"""Runs a campaign's trials on Dask workers, and keeps each result as soon as it is there."""

from __future__ import annotations

import asyncio
import collections
import concurrent.futures
import contextlib
import queue
import time
import uuid
from pathlib import Path
from typing import TYPE_CHECKING, Deque, Dict, Hashable, Iterator, List, NamedTuple, Optional, Sequence, Tuple, Union

from diff_encoder_sim.base.atomic_files import write_file
from diff_encoder_sim.base.deferred import deferred
from diff_encoder_sim.base.errors import CampaignFault, ConfigError
from diff_encoder_sim.trials.campaign_cells import Campaign, TrialJob
from diff_encoder_sim.trials.cluster import Workers
from diff_encoder_sim.trials.progress import Progress
from diff_encoder_sim.trials.results import ResultStore
from diff_encoder_sim.trials.trial_run import run_trials
from diff_encoder_sim.trials.trial_setup import drive_params
from diff_encoder_sim.trials.worker import FinishedTrial, HostFault, PlacedJob, ResultsFolder, RunTrials, run_task

if TYPE_CHECKING:
    from distributed import Future

    TaskFuture = Future[List[FinishedTrial]]


# Each has a bag open; and what is under way is lost with its worker.
MOST_TOGETHER = 16

TrialGroup = Tuple[TrialJob, ...]


def trial_groups(campaign: Campaign, jobs: Sequence[TrialJob]) -> List[TrialGroup]:
    """Put together the scripted trials that differ in encoder and odometry alone, in the order of their first."""
    if campaign.params.nav != 'scripted':
        return [(job,) for job in jobs]
    drives = _drives(campaign)
    groups: Dict[Tuple[int, int], List[TrialJob]] = {}
    for job in jobs:
        groups.setdefault((drives[job.cell_index], job.seed), []).append(job)
    return [
        tuple(group[begin : begin + MOST_TOGETHER])
        for group in groups.values()
        for begin in range(0, len(group), MOST_TOGETHER)
    ]


def _drives(campaign: Campaign) -> List[int]:
    """Return a number for each cell: equal ones are one drive where the seeds are equal, too."""
    numbers: Dict[Tuple[object, ...], int] = {}
    return [
        numbers.setdefault((cell.test.name, *drive_params(cell.robot_params)), len(numbers)) for cell in campaign.cells
    ]


# Tasks under way per thread of the workers: one runs, one waits there for its turn.
TASKS_PER_THREAD = 2
# A task costs the client some 3 ms, whatever is in it: short trials share one, as far as their rows are not late by it.
TASK_S = 0.1
MOST_GROUPS = 16

Task = Tuple[TrialGroup, ...]


class TrialQueue:
    """Groups of trials in their order, as tasks: of several groups where these were short so far."""

    def __init__(self, groups: Sequence[TrialGroup] = (), alone: Sequence[TrialGroup] = ()) -> None:
        """Begin; each of `alone` is a task of its own, before the others."""
        self._waiting: Deque[TrialGroup] = collections.deque(groups)
        self._alone: Deque[TrialGroup] = collections.deque(alone)
        self._group_s: Dict[int, float] = {}  # of the last task, by the cell of a group's first trial

    def __len__(self) -> int:
        return len(self._alone) + len(self._waiting)

    def take(self, threads: int, running: int) -> Task:
        """Take the next task.

        Args:
            threads: of all workers, which are to be busy until the end.
            running: how many tasks are under way.
        """
        if self._alone:
            return (self._alone.popleft(),)
        self._split(threads - running)
        cell = _cell(self._waiting[0])
        most = min(self._most_groups(cell), len(self._waiting) // (TASKS_PER_THREAD * max(1, threads)))
        task = [self._waiting.popleft()]
        while len(task) < most and _cell(self._waiting[0]) == cell:
            task.append(self._waiting.popleft())
        return tuple(task)

    def put_back(self, task: Task) -> None:
        """Have the parts of a task run alone, as one of them went wrong and nobody knows which."""
        parts = task if len(task) > 1 else [(job,) for job in task[0]]
        self._alone.extendleft(reversed(parts))

    def measure(self, task: Task, spent_s: float) -> None:
        """Tell how long a task took."""
        self._group_s[_cell(task[0])] = spent_s / len(task)

    def _most_groups(self, cell: int) -> int:
        return int(TASK_S / max(self._group_s.get(cell, TASK_S), TASK_S / MOST_GROUPS))

    def _split(self, threads: int) -> None:
        """Halve the largest groups, until there is one for each thread or each is a single trial."""
        while len(self._waiting) < threads:
            largest = max(range(len(self._waiting)), key=lambda index: len(self._waiting[index]))
            group, half = self._waiting[largest], (len(self._waiting[largest]) + 1) // 2
            if len(group) == 1:
                return
            self._waiting[largest] = group[:half]
            self._waiting.insert(largest + 1, group[half:])


def _cell(group: Sequence[TrialJob]) -> int:
    return group[0].cell_index


TICK_S = 1.0
PROBE_PREFIX = '.probe-'


distributed = deferred('distributed')

_CANCELLED = (asyncio.CancelledError, concurrent.futures.CancelledError)


class _TrialFault(Exception):
    """Why a task has no results, by the fault of one of its trials."""

    def __init__(self, reason: str, killed_workers: bool) -> None:
        super().__init__(reason)
        self.killed_workers = killed_workers


class UnrunTrial(NamedTuple):
    """A trial without a result."""

    job: TrialJob
    reason: str
    killed_workers: bool  # rather than raised an error


def run_campaign(
    workers: Workers,
    campaign: Campaign,
    store: ResultStore,
    progress: Progress,
    jobs: Sequence[TrialJob],
    run: RunTrials = run_trials,
) -> List[UnrunTrial]:
    """Run trials that `store` has no result of yet, and return those that could not be run.

    Raises:
        CampaignFault: the scheduler is gone, or a host cannot run trials or keep their results.
    """
    with _probe(store.folder) as results:
        engine = _Engine(workers, campaign, store, progress, results, run)
        unrun = engine.run(TrialQueue(trial_groups(campaign, jobs)))
        # A trial that kills its worker also loses the trials that wait there: each is run once more, alone.
        killers = [(trial.job,) for trial in unrun if trial.killed_workers]
        unrun = [trial for trial in unrun if not trial.killed_workers]
        return unrun + engine.run(TrialQueue(alone=killers), at_once=1)


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
        self._client = workers.client
        self._problem_of_workers = workers.problem
        self._store = store
        self._progress = progress
        self._results = results
        self._run = run
        # Unique on a scheduler that serves several campaigns.
        self._name = uuid.uuid4().hex[:8]
        # A task, not scattered data: Dask makes it again when the worker that holds it dies.
        self._campaign = self._client.submit(_identity, campaign, key=f'campaign-{self._name}', pure=False)
        self._running: Dict[Hashable, Tuple[Task, TaskFuture]] = {}
        self._ended: queue.SimpleQueue[TaskFuture] = queue.SimpleQueue()
        self._threads = 0
        self._next_tick_s = 0.0

    def run(self, waiting: TrialQueue, at_once: Optional[int] = None) -> List[UnrunTrial]:
        """Run trials, `at_once` tasks at a time or as many as keep all workers busy."""
        unrun = []
        while waiting or self._running:
            self._tick()
            limit = at_once or max(1, TASKS_PER_THREAD * self._threads)
            while waiting and len(self._running) < limit:
                self._submit(waiting.take(self._threads, len(self._running)))
            with contextlib.suppress(queue.Empty):
                task, future = self._running.pop(self._ended.get(timeout=TICK_S).key)
                unrun += self._end(task, future, waiting)
        return unrun

    def _submit(self, task: Task) -> None:
        placed = [[PlacedJob(job, self._store.bag_path(job)) for job in group] for group in task]
        # Job indices begin anew in no campaign: a key names one attempt of the client.
        future = self._client.submit(
            run_task,
            self._campaign,
            placed,
            self._results,
            self._run,
            key=f'trial-{self._name}-{task[0][0].position}-{uuid.uuid4().hex[:8]}',
            pure=False,
        )
        self._running[future.key] = task, future
        future.add_done_callback(self._ended.put)

    def _end(self, task: Task, future: TaskFuture, waiting: TrialQueue) -> List[UnrunTrial]:
        """Keep the results of a task, or return its only trial with what went wrong; of several, each is run alone."""
        try:
            results = self._results_of(future)
        except _TrialFault as fault:
            if len(task) == len(task[0]) == 1:
                return [UnrunTrial(task[0][0], str(fault), fault.killed_workers)]
            waiting.put_back(task)
            return []
        waiting.measure(task, sum(finished.row.wall_time_s for finished in results))
        for finished in results:
            self._keep(finished)
        return []

    def _results_of(self, future: TaskFuture) -> List[FinishedTrial]:
        try:
            return future.result()
        except distributed.KilledWorker:
            raise _TrialFault('each worker that began it died', True) from None
        except (HostFault, ImportError) as error:
            raise self._fault(str(error)) from None
        except _CANCELLED:
            raise self._scheduler_gone() from None
        except Exception as error:  # of a trial: a fault of this program, not of the others
            self._check_scheduler()
            raise _TrialFault(f'{type(error).__name__}: {error}', False) from None

    def _keep(self, finished: FinishedTrial) -> None:
        try:
            if finished.bag is not None:
                write_file(self._store.folder / finished.row.bag, finished.bag)
            self._store.append(finished.row)
        except OSError as error:
            raise self._fault(f'{error.filename}: cannot be written: {error.strerror}') from None
        except ConfigError as error:
            raise self._fault(str(error)) from None
        self._progress.add(finished.row)

    def _tick(self) -> None:
        """Check once a second that the scheduler answers, and which workers there are."""
        if time.monotonic() < self._next_tick_s:
            return
        self._check_scheduler()
        try:
            self._threads = sum(self._client.nthreads().values())
        except OSError:
            raise self._scheduler_gone() from None
        problem = self._problem_of_workers()
        if problem is not None:
            raise self._fault(problem)
        self._progress.tick(self._threads)
        self._next_tick_s = time.monotonic() + TICK_S

    def _check_scheduler(self) -> None:
        # While a client reconnects, the scheduler has already dropped its tasks.
        if self._client.status != 'running':
            raise self._scheduler_gone()

    def _scheduler_gone(self) -> CampaignFault:
        return self._fault('the scheduler does not answer any more')

    def _fault(self, reason: str) -> CampaignFault:
        return CampaignFault(f'{reason}; {self._progress.count()} are done; run the same command again to continue')


@contextlib.contextmanager
def _probe(folder: Union[str, Path]) -> Iterator[ResultsFolder]:
    """Write a file by which workers find out whether they see the results folder.

    Raises:
        CampaignFault: it cannot be written.
    """
    folder = Path(folder).resolve()
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


def _identity(campaign: Campaign) -> Campaign:
    return campaign
