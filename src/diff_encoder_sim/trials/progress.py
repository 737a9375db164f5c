"""Progress of a campaign on stderr, and a table of its outcomes."""

from __future__ import annotations

import collections
import math
import time
from typing import Counter, Dict, Optional, Sequence, TextIO, Tuple

from tabulate import tabulate
from tqdm import tqdm

from diff_encoder_sim.base.command_line import Stopped
from diff_encoder_sim.drives.test_definition import TestDefinition
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.trials.campaign_cells import Campaign, RequestedTrial
from diff_encoder_sim.trials.route_driver import TurnInPlace, stages_of
from diff_encoder_sim.trials.scripted_drive import ScriptedDrive
from diff_encoder_sim.trials.trials_csv import OUTCOMES, TrialRow

# Assumed speed of a worker, weighted like this number of seconds of measured work, as the first trials also load
# machine code. The measured speed is in docs/campaigns.md.
ASSUMED_SPEED, ASSUMED_FOR_S = 50.0, 5.0
LINE_EVERY_FRACTION, LINE_EVERY_S = 0.1, 30.0


def shortest_drive_s(test: TestDefinition, nav: str) -> float:
    """Compute the time that a test takes from point to point at its highest speeds; at least 1 s [s]."""
    if nav == 'scripted':
        return max(1.0, ScriptedDrive(test).duration_s)
    pose, duration_s = test.start.pose(), 0.0
    for stage in stages_of(test):
        if isinstance(stage, TurnInPlace):
            duration_s += abs(stage.angle_rad) / test.limits.angular_speed
        else:
            duration_s += math.dist(pose[:2], stage.pose_in_map[:2]) / test.limits.speed
            pose = stage.pose_in_map
    return max(1.0, min(duration_s, test.time_limit))


class Progress:
    """Counts trials, estimates the time left and shows both: as a bar on a terminal, else as lines. A context manager.

    The remaining time follows from the shortest time of each drive and the speed of finished trials. Lines are printed
    at the first tick, when the first worker has started, and then every 10 % or 30 s.
    """

    def __init__(
        self, stream: TextIO, campaign: Campaign, pending: Sequence[RequestedTrial], done: Sequence[TrialRow] = ()
    ) -> None:
        """`done` are the results of earlier runs."""
        self._drives_s = {test.name: shortest_drive_s(test, campaign.params.nav) for test in campaign.tests}
        self._left_s = sum(self._drives_s[trial.cell.test.name] for trial in pending)
        self._driven_s = ASSUMED_FOR_S * ASSUMED_SPEED + sum(self._drives_s[row.test] for row in done)
        self._work_s = ASSUMED_FOR_S + sum(row.wall_time_s for row in done)
        self.total, self.done, self.done_now = len(pending) + len(done), len(done), 0
        self._failed = sum(row.outcome is not Outcome.SUCCEEDED for row in done)
        self._simulated_s, self._workers = 0.0, 0
        self._stream, self._began_s = stream, time.monotonic()
        self._shown = self.done, -LINE_EVERY_S, False  # trials, time and whether there were workers at the last line
        self._bar = tqdm(
            total=self.total,
            initial=self.done,
            file=stream,
            dynamic_ncols=True,
            bar_format='{percentage:3.0f}% |{bar}| {desc}',
            desc=self.text(),
            disable=not stream.isatty(),
        )

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, _: object, error: Optional[BaseException], *__: object) -> None:
        if isinstance(error, Stopped):
            error.when = f'after {self.count()}; run the same command again to continue'
        self._bar.refresh()
        self._bar.close()

    def add(self, row: TrialRow) -> None:
        """Count a trial that has ended."""
        self.done += 1
        self.done_now += 1
        self._failed += row.outcome is not Outcome.SUCCEEDED
        self._simulated_s += row.duration_s
        self._left_s -= self._drives_s[row.test]
        self._driven_s += self._drives_s[row.test]
        self._work_s += row.wall_time_s
        self._show()

    def tick(self, workers: int) -> None:
        """Update the number of workers and the time."""
        self._workers = workers
        self._show()

    def count(self) -> str:
        """Return a text such as '120 of 360 trials'."""
        return f'{self.done} of {self.total} trials'

    def left_s(self) -> float:
        """Return the estimate of the remaining time [s]."""
        return max(self._left_s, 0.0) * self._work_s / self._driven_s / max(1, self._workers)

    def text(self) -> str:
        """Return the state in one line."""
        parts = [self.count(), f'{self._failed} failed']
        if self._workers == 0 and self.done < self.total:
            return ', '.join([*parts, 'waiting for workers to start'])
        parts.append(f'{self._workers} worker{"" if self._workers == 1 else "s"}')
        if self.done_now:
            parts.append(f'{self.real_time_factor():.0f} x real time')
        return ', '.join([*parts, f'about {tqdm.format_interval(self.left_s())} left'])

    def wall_time_s(self) -> float:
        """Return the time since the start [s]."""
        return time.monotonic() - self._began_s

    def real_time_factor(self) -> float:
        """Return simulated seconds per second of wall time."""
        return self._simulated_s / max(self.wall_time_s(), 1e-9)

    def _show(self) -> None:
        if not self._bar.disable:
            self._bar.set_description_str(self.text(), refresh=False)
            self._bar.update(self.done - self._bar.n)
            return
        now_s, (shown_done, shown_s, had_workers) = time.monotonic(), self._shown
        is_far = self.done - shown_done >= LINE_EVERY_FRACTION * self.total or self.done == self.total > shown_done
        if is_far or (self._workers > 0 and not had_workers) or now_s - shown_s >= LINE_EVERY_S:
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
        ['test', *varied, 'counts', 'trials', *(outcome.value for outcome in shown)],
        disable_numparse=True,
        colalign=('left', *['right'] * (len(varied) + 2 + len(shown))),
    )
