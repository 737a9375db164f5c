"""A results folder as a campaign writes it, of trials that nobody has run: any number of them."""

from __future__ import annotations

from pathlib import Path
from typing import Iterator

import numpy as np
from checkout import ROOT

from diff_encoder_sim.base.atomic_files import write_file
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.trials.campaign_cells import Campaign
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.trials.results import ResultStore
from diff_encoder_sim.trials.trials_csv import TABLE, TrialRow, csv_line, fields_of, header

# How far the final errors are spread with the coarsest encoder: x [m], y [m], yaw [rad].
SPREAD = np.array([0.02, 0.05, 0.02])
TIMED_OUT_FRACTION = 0.01


def make_results(folder: Path, trials: int, config: str = 'paper') -> int:
    """Write a finished campaign without bags into a new folder; return how many trials it has.

    Args:
        folder: for manifest.json and trials.csv.
        trials: of each cell.
        config: the campaign whose cells these are.
    """
    campaign = load_campaign(config, ROOT, {'trials': trials, 'record': 'none'})
    ResultStore(folder, campaign, {}).finish()
    fields = [header(campaign.params.varied_keys), *map(fields_of, _rows(campaign))]
    write_file(folder / TABLE, b''.join(map(csv_line, fields)))
    return len(fields) - 1


def _rows(campaign: Campaign) -> Iterator[TrialRow]:
    rng = np.random.default_rng(1)
    for job in campaign.trials():
        cell = job.cell
        spread = SPREAD * campaign.cells[0].ppr.left / cell.ppr.left
        draws = rng.normal(0.0, spread, (len(PoseSource), 3)).tolist()
        outcome = Outcome.TIMED_OUT if rng.random() < TIMED_OUT_FRACTION else Outcome.SUCCEEDED
        yield TrialRow(
            cell.test.name,
            cell.encoder.label,
            cell.varied_texts(),
            job.trial,
            job.seed,
            outcome,
            '' if outcome is Outcome.SUCCEEDED else 'made up',
            60.0,
            {source: Pose2D(*draw) for source, draw in zip(PoseSource, draws)},
            20.0,
            1.0,
            '',
        )
