"""How long the trials of a campaign that are left will take: known roughly before the first has ended."""

from __future__ import annotations

import itertools
import math
from typing import Dict, List, Sequence, Union

from diff_encoder_sim.drives.test_definition import Point, PoseParams, TestDefinition
from diff_encoder_sim.trials.campaign_cells import Campaign, TrialJob
from diff_encoder_sim.trials.results import TrialRow

# What is assumed of a worker, and counts as much as so many seconds of measured work: the first trials also wait for
# machine code to be loaded. docs/campaigns.md has the measured speed.
ASSUMED_SPEED, ASSUMED_FOR_S = 50.0, 5.0


class TimeLeft:
    """Adds up the trials by how long the robot drives in each, at the speed of those that are done."""

    def __init__(self, drives_s: Dict[str, float], pending: Sequence[str], done: Sequence[TrialRow] = ()) -> None:
        """Begin.

        Args:
            drives_s: `shortest_drive_s` of each test by its name.
            pending: names of the tests of the trials that will be run.
            done: results of earlier runs.
        """
        self._drives_s = drives_s
        self._work_s, self._driven_s = ASSUMED_FOR_S, ASSUMED_FOR_S * ASSUMED_SPEED
        self._left_s = sum(drives_s[test] for test in pending)
        for row in done:
            self._measure(row)

    def add(self, row: TrialRow) -> None:
        """Count a trial that has ended."""
        self._left_s -= self._drives_s[row.test]
        self._measure(row)

    def seconds(self, workers: int) -> float:
        """Return how long `workers` need for the rest [s]."""
        return max(self._left_s, 0.0) * self._work_s / self._driven_s / workers

    def _measure(self, row: TrialRow) -> None:
        self._work_s += row.wall_time_s
        self._driven_s += self._drives_s[row.test]


def time_left(campaign: Campaign, jobs: Sequence[TrialJob], done: Sequence[TrialRow] = ()) -> TimeLeft:
    """Estimate the time of `jobs`; `done` are the results of earlier runs."""
    drives_s = {cell.test.name: shortest_drive_s(cell.test, campaign.params.nav) for cell in campaign.cells}
    return TimeLeft(drives_s, [campaign.cells[job.cell_index].test.name for job in jobs], done)


def shortest_drive_s(test: TestDefinition, nav: str) -> float:
    """Compute how long a test takes from point to point at its highest speeds; at least 1 s [s]."""
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
