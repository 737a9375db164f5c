"""Loads the dataset that the user names: a campaign's folder, or bags of trials."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Sequence

from diff_encoder_sim.analysis.bag_dataset import bag_dataset
from diff_encoder_sim.analysis.campaign_dataset import campaign_dataset
from diff_encoder_sim.analysis.campaign_folder import is_campaign
from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.base.errors import ConfigError

log = logging.getLogger(__name__)


def load_dataset(paths: Sequence[Path]) -> Dataset:
    """Read a campaign's folder, or bags and folders of bags.

    What cannot be analysed is left out, with a warning and a note in the dataset.

    Raises:
        ConfigError: nothing can be analysed, or a campaign's folder is among other paths.
    """
    campaigns = [path for path in paths if path.is_dir() and is_campaign(path)]
    if campaigns and len(paths) > 1:
        raise ConfigError(f"{campaigns[0]}: a campaign's folder; expected it alone, or bags")
    dataset = campaign_dataset(campaigns[0]) if campaigns else bag_dataset(paths)
    for note in dataset.notes:
        log.warning('%s', note)
    return dataset._replace(
        trials=[trial for trials in dataset.cells().values() for trial in sorted(trials, key=lambda trial: trial.trial)]
    )
