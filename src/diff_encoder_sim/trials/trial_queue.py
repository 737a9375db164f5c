"""Trials that wait for workers, and how many of them a worker is given at once."""

from __future__ import annotations

import collections
from typing import Deque, Dict, Sequence, Tuple

from diff_encoder_sim.trials.campaign_cells import TrialJob
from diff_encoder_sim.trials.trial_groups import TrialGroup

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
