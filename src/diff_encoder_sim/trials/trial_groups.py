"""Trials of a campaign that are one drive of the robot: a worker runs them at once."""

from __future__ import annotations

from typing import Dict, List, Sequence, Tuple

from diff_encoder_sim.trials.campaign_cells import Campaign, TrialJob
from diff_encoder_sim.trials.trial_setup import drive_params

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
