"""Runs a campaign's trials on an Executor and stores each result immediately."""

from __future__ import annotations

import concurrent.futures
import time
from collections import deque
from concurrent.futures import Future
from typing import Callable, Dict, Iterable, Iterator, List, Optional, Sequence, Tuple

from diff_encoder_sim.base.atomic_files import write_file
from diff_encoder_sim.base.errors import CampaignFault, ConfigError
from diff_encoder_sim.trials.campaign_cells import Campaign, RequestedTrial
from diff_encoder_sim.trials.executors import Workers
from diff_encoder_sim.trials.progress import Progress
from diff_encoder_sim.trials.results import ResultStore
from diff_encoder_sim.trials.trial_run import FinishedTrial, RunTrials, run_group, run_trials

MOST_TOGETHER = 16  # open bags per group; all are lost with their worker
TASKS_PER_WORKER = 2  # submitted: one runs, the others are queued
TICK_S = 1.0

TrialGroup = Tuple[RequestedTrial, ...]


def trial_groups(trials: Sequence[RequestedTrial]) -> List[TrialGroup]:
    """Group scripted trials of the same drive, which differ only in encoder and odometry."""
    groups: Dict[Tuple[object, ...], List[RequestedTrial]] = {}
    for trial in trials:
        params = trial.cell.robot_params
        drive: Tuple[object, ...] = (trial.position,)
        if trial.campaign.nav == 'scripted':
            # What changes the drive, or its messages except those of encoder and odometry.
            frames = params.amcl.global_frame_id, params.odometry.odom_frame
            drive = trial.cell.test.name, trial.seed, params.simulator, params.latency.command, *frames
        groups.setdefault(drive, []).append(trial)
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
) -> Dict[str, List[str]]:
    """Run pending trials of `store`; return those that could not be run, by reason; CampaignFault if none can be."""
    files, results = workers.send(campaign.files), store.shared_folder()
    unrun: Dict[str, List[str]] = {}

    def submit(group: TrialGroup) -> Future[List[FinishedTrial]]:
        return workers.submit(run_group, files, group, results, run)

    def run_all(groups: Sequence[TrialGroup], at_once: Optional[int] = None) -> Tuple[List[TrialGroup], ...]:
        """Return the groups of which a trial failed, and those whose worker died."""
        failed: List[TrialGroup] = []
        lost: List[TrialGroup] = []
        for group, future in _window(workers, progress, submit, groups, at_once):
            try:
                finished = future.result()
            except workers.lost:
                lost.append(group)
            except (CampaignFault, ImportError, concurrent.futures.CancelledError):
                raise
            except Exception as error:  # a fault of one trial; the others continue
                workers.count()  # raises if it is the scheduler's
                if len(group) > 1:
                    failed.append(group)
                else:
                    unrun.setdefault(f'{type(error).__name__}: {error}', []).append(group[0].name)
            else:
                for row, bag in finished:
                    if bag is not None:
                        write_file(store.folder / row.bag, bag)
                    store.append(row)
                    progress.add(row)
        return failed, lost

    try:
        failed, lost = run_all(trial_groups(trials))
        _, more = run_all(_singles(failed))  # of each of these groups one trial is at fault
        _, fatal = run_all(_singles([*lost, *more]), at_once=1)
        if fatal:
            unrun['each worker that began it died'] = [trial.name for (trial,) in fatal]
        return unrun
    except (CampaignFault, ImportError, ConfigError) as error:
        reason = str(error)
    except concurrent.futures.CancelledError:
        reason = 'the scheduler does not answer any more'
    except OSError as error:
        reason = f'{error.filename}: cannot be written: {error.strerror}'
    raise CampaignFault(f'{reason}; {progress.count()} are done; run the same command again to continue')


def _singles(groups: Iterable[TrialGroup]) -> List[TrialGroup]:
    return [(trial,) for group in groups for trial in group]


def _window(
    workers: Workers,
    progress: Progress,
    submit: Callable[[TrialGroup], Future[List[FinishedTrial]]],
    groups: Sequence[TrialGroup],
    at_once: Optional[int],
) -> Iterator[Tuple[TrialGroup, Future[List[FinishedTrial]]]]:
    """Submit groups, `at_once` at a time or as many as keep all workers busy; yield each as it ends."""
    waiting = deque(groups)
    running: Dict[Future[List[FinishedTrial]], TrialGroup] = {}
    count, next_tick_s = 0, 0.0
    while waiting or running:
        if time.monotonic() >= next_tick_s:
            count = workers.count()
            progress.tick(count)
            next_tick_s = time.monotonic() + TICK_S
        while waiting and len(running) < (at_once or max(1, TASKS_PER_WORKER * count)):
            group = waiting.popleft()
            running[submit(group)] = group
        ended, _ = concurrent.futures.wait(running, TICK_S, concurrent.futures.FIRST_COMPLETED)
        for future in ended:
            yield running.pop(future), future
