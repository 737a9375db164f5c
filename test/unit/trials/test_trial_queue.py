"""Which trials a worker is given at once."""

import pytest

from diff_encoder_sim.trials.campaign_cells import TrialJob
from diff_encoder_sim.trials.engine import MOST_GROUPS, TASK_S, TrialQueue


def groups_of(sizes, cell=0):
    """Groups of so many trials, numbered through."""
    numbers = iter(range(1000))
    return [tuple(TrialJob(next(numbers), cell, 1, 1) for _ in range(size)) for size in sizes]


def taken(queue, threads=1, running=0):
    """The positions of the trials of the next task, by group."""
    return [[job.position for job in group] for group in queue.take(threads, running)]


def after_a_task(sizes, group_s):
    """A queue from which one task was taken, which took so long."""
    queue = TrialQueue(groups_of(sizes))
    task = queue.take(1, 0)
    queue.measure(task, group_s)
    return queue


def test_groups_are_tasks_in_their_order_where_their_time_is_not_known():
    queue = TrialQueue(groups_of([1, 2, 1]))
    assert [taken(queue) for _ in range(3)] == [[[0]], [[1, 2]], [[3]]]
    assert len(queue) == 0


@pytest.mark.parametrize(
    ('group_s', 'groups'), [(0.0, MOST_GROUPS), (TASK_S / 3.5, 3), (TASK_S / 1.5, 1), (100.0 * TASK_S, 1)]
)
def test_short_trials_share_a_task(group_s, groups):
    queue = after_a_task([1] * 100, group_s)
    assert taken(queue) == [[number] for number in range(1, 1 + groups)]


def test_the_time_of_a_task_is_that_of_all_its_groups():
    queue = after_a_task([1] * 100, 0.0)
    queue.measure(queue.take(1, 0), MOST_GROUPS * TASK_S)
    assert len(taken(queue)) == 1


def test_what_trials_of_one_cell_took_is_not_said_of_another():
    queue = TrialQueue([*groups_of([1] * 3), *groups_of([1] * 100, cell=1)])
    queue.measure(queue.take(1, 0), 0.0)
    assert [len(taken(queue)), len(taken(queue))] == [2, 1]


def test_towards_the_end_each_thread_gets_tasks():
    queue = after_a_task([1] * 13, 0.0)
    sizes = []
    while queue:
        sizes.append(len(taken(queue, threads=2)))
    assert sizes == [3, 2, 1, 1, 1, 1, 1, 1, 1]


def test_of_a_task_that_went_wrong_each_group_is_run_alone_and_then_each_trial():
    queue = after_a_task([1, 2, 1, *[1] * 50], TASK_S / 2.0)
    queue.put_back(queue.take(1, 0))
    task = queue.take(1, 0)
    assert [job.position for job in task[0]] == [1, 2]
    queue.put_back(task)
    assert [taken(queue) for _ in range(3)] == [[[1]], [[2]], [[3]]]
    assert taken(queue) == [[4], [5]]


def test_those_alone_share_no_task_however_short():
    queue = TrialQueue(alone=groups_of([1] * 40))
    queue.measure(queue.take(1, 0), 0.0)
    assert taken(queue) == [[1]]


@pytest.mark.parametrize(
    ('threads', 'running', 'sizes', 'expected'),
    [
        (1, 0, [4, 4], [4, 4]),
        (2, 0, [4, 4], [4, 4]),
        (3, 0, [4, 4], [2, 2, 4]),
        (4, 0, [5], [1, 1, 1, 2]),
        (4, 2, [5], [3, 2]),
        (9, 0, [2, 1], [1, 1, 1]),
        (0, 0, [4], [4]),
    ],
)
def test_groups_are_split_where_workers_would_be_idle(threads, running, sizes, expected):
    queue = TrialQueue(groups_of(sizes))
    found = []
    while queue:
        found += map(len, queue.take(threads, running + len(found)))
    assert found == expected
