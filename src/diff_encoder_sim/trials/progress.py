"""Progress of a campaign on stderr, and a table of its outcomes."""

from __future__ import annotations

import collections
import itertools
import math
import time
from typing import Callable, Counter, Dict, List, Sequence, TextIO, Tuple, Union

from tabulate import tabulate
from tqdm import tqdm

from diff_encoder_sim.drives.test_definition import Point, PoseParams, TestDefinition
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.trials.campaign_cells import Campaign, RequestedTrial
from diff_encoder_sim.trials.trials_csv import OUTCOMES, TrialRow

# Assumed speed of a worker, weighted like this number of seconds of measured work, as the first trials also load
# machine code. The measured speed is in docs/campaigns.md.
ASSUMED_SPEED, ASSUMED_FOR_S = 50.0, 5.0


class TimeLeft:
    """Estimates the remaining time from the drive time of each trial and the speed of finished trials."""

    def __init__(self, drives_s: Dict[str, float], pending: Sequence[str], done: Sequence[TrialRow] = ()) -> None:
        """Create the estimate.

        Args:
            drives_s: `shortest_drive_s` of each test by its name.
            pending: names of the tests of the trials that will be run.
            done: results of earlier runs.
        """
        self._drives_s = drives_s
        self._work_s, self._driven_s = ASSUMED_FOR_S, ASSUMED_FOR_S * ASSUMED_SPEED
        self._left_s = sum(drives_s[test] for test in pending)
        for row in done:
            self._left_s += drives_s[row.test]
            self.add(row)

    def add(self, row: TrialRow) -> None:
        """Count a trial that has ended."""
        self._left_s -= self._drives_s[row.test]
        self._work_s += row.wall_time_s
        self._driven_s += self._drives_s[row.test]

    def seconds(self, workers: int) -> float:
        """Return the remaining time with `workers` [s]."""
        return max(self._left_s, 0.0) * self._work_s / self._driven_s / workers


def time_left(campaign: Campaign, pending: Sequence[RequestedTrial], done: Sequence[TrialRow] = ()) -> TimeLeft:
    """Estimate the time of `pending` trials; `done` are the results of earlier runs."""
    drives_s = {cell.test.name: shortest_drive_s(cell.test, campaign.params.nav) for cell in campaign.cells}
    return TimeLeft(drives_s, [trial.cell.test.name for trial in pending], done)


def shortest_drive_s(test: TestDefinition, nav: str) -> float:
    """Compute the time that a test takes from point to point at its highest speeds; at least 1 s [s]."""
    if nav == 'scripted':
        distance_m = sum(abs(segment.straight or 0.0) for segment in test.drive)
        turns = sum(abs(segment.turns or 0.0) for segment in test.drive)
    else:
        legs: List[Sequence[Union[Point, PoseParams]]] = [
            leg.through or ([leg.goal] if leg.goal else []) for leg in test.route
        ]
        points = [(point.x, point.y) for point in (test.start, *itertools.chain.from_iterable(legs))]
        distance_m = sum(math.dist(*pair) for pair in zip(points, points[1:]))
        turns = sum(abs(leg.turns or 0.0) for leg in test.route)
    duration_s = distance_m / test.limits.speed + 2.0 * math.pi * turns / test.limits.angular_speed
    return max(1.0, duration_s if nav == 'scripted' else min(duration_s, test.time_limit))


LINE_EVERY_FRACTION = 0.1
LINE_EVERY_S = 30.0


class Progress:
    """Counts trials and shows the progress: a bar on a terminal, else lines. A context manager.

    Lines are printed at the first tick, when the first worker has started, and then every 10 % or 30 s.
    """

    def __init__(
        self,
        stream: TextIO,
        total: int,
        done: Sequence[TrialRow],
        left: TimeLeft,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """`done` are the results of earlier runs; `clock` returns seconds."""
        self.total, self.done = total, len(done)
        self._left, self._stream, self._clock = left, stream, clock
        self._began_s, self._done_before = clock(), len(done)
        self._failed = sum(row.outcome is not Outcome.SUCCEEDED for row in done)
        self._simulated_s, self._workers = 0.0, 0
        self._shown = self.done, -LINE_EVERY_S, False  # trials, time and whether there were workers at the last line
        self._bar = tqdm(
            total=total,
            initial=self.done,
            file=stream,
            dynamic_ncols=True,
            bar_format='{percentage:3.0f}% |{bar}| {desc}',
            desc=self.text(),
            disable=not stream.isatty(),
        )

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.refresh()
        self._bar.close()

    def add(self, row: TrialRow) -> None:
        """Count a trial that has ended."""
        self.done += 1
        self._failed += row.outcome is not Outcome.SUCCEEDED
        self._simulated_s += row.duration_s
        self._left.add(row)
        self._show()

    def tick(self, workers: int) -> None:
        """Update the number of workers and the time."""
        self._workers = workers
        self._show()

    def count(self) -> str:
        """Return a text such as '120 of 360 trials'."""
        return f'{self.done} of {self.total} trials'

    def text(self) -> str:
        """Return the state in one line."""
        if self._workers == 0 and self.done < self.total:
            return f'{self.count()}, {self._failed} failed, waiting for workers to start'
        parts = [self.count(), f'{self._failed} failed', f'{self._workers} worker{"" if self._workers == 1 else "s"}']
        if self.done_now:
            parts.append(f'{self.real_time_factor():.0f} x real time')
        left_s = self._left.seconds(max(1, self._workers)) if self.done < self.total else 0.0
        return ', '.join([*parts, f'about {tqdm.format_interval(left_s)} left'])

    @property
    def done_now(self) -> int:
        """Number of trials that this run has added."""
        return self.done - self._done_before

    def wall_time_s(self) -> float:
        """Return the time since the start [s]."""
        return self._clock() - self._began_s

    def real_time_factor(self) -> float:
        """Return simulated seconds per second of wall time."""
        return self._simulated_s / max(self.wall_time_s(), 1e-9)

    def _show(self) -> None:
        if not self._bar.disable:
            self._bar.set_description_str(self.text(), refresh=False)
            self._bar.update(self.done - self._bar.n)
            return
        now_s, (shown_done, shown_s, had_workers) = self._clock(), self._shown
        is_far = self.done - shown_done >= LINE_EVERY_FRACTION * self.total
        is_last = self.done == self.total > shown_done
        is_first = self._workers > 0 and not had_workers
        if is_far or is_last or is_first or now_s - shown_s >= LINE_EVERY_S:
            print(self.text(), file=self._stream, flush=True)
            self._shown = self.done, now_s, self._workers > 0


def outcome_table(rows: Sequence[TrialRow]) -> str:
    """Count the outcomes of each cell's trials, as a table; outcomes without trials are omitted."""
    cells: Dict[Tuple[str, ...], Counter[Outcome]] = {}
    for row in rows:
        cell = (row.test, *(text for _, text in row.varied), row.ppr)
        cells.setdefault(cell, collections.Counter())[row.outcome] += 1
    shown = [outcome for outcome in OUTCOMES if any(counts[outcome] for counts in cells.values())]
    varied = [key for key, _ in rows[0].varied] if rows else []
    return tabulate(
        [[*cell, sum(counts.values()), *(counts[outcome] for outcome in shown)] for cell, counts in cells.items()],
        ['test', *varied, 'PPR', 'trials', *(outcome.value for outcome in shown)],
        disable_numparse=True,
        colalign=('left', *['right'] * (len(varied) + 2 + len(shown))),
    )
