"""Makes a dataset of bags that belong to no campaign: everything is computed from the recordings."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Dict, List, Sequence

from diff_encoder_sim.analysis.bag_trial import BagTrial, read_bag_trials, robot_of
from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.bag_source import bags_in
from diff_encoder_sim.trials.campaign_cells import VARIANT
from diff_encoder_sim.trials.results import MANIFEST

log = logging.getLogger(__name__)

# Trials that differ in one of these are not pooled: it becomes a varied parameter.
KEPT_APART = ('nav', VARIANT, 'wheel_diameter', 'wheel_separation')


def bag_dataset(paths: Sequence[Path]) -> Dataset:
    """Read bags, and folders of bags.

    Raises:
        ConfigError: there is none that can be analysed, or a folder has a campaign in it.
    """
    read = read_bag_trials(_bags_in(paths))
    notes = [bag for bag in read if isinstance(bag, str)]
    found = _distinct([bag for bag in read if not isinstance(bag, str)], notes)
    if not found:
        for note in notes[:-1]:
            log.warning('%s', note)
        raise ConfigError(notes[-1])
    varied = _differences(found, notes)
    title = paths[0].resolve().stem if len(paths) == 1 else f'{len(found)} trials'
    return Dataset(
        title,
        [bag.data._replace(varied=tuple((key, str(getattr(bag.trial, key))) for key in varied)) for bag in found],
        notes,
        None,
        None,
        robot_of(found[0].trial),
        {bag.trial.test.name: bag.trial for bag in found[::-1]},
    )


def _bags_in(paths: Sequence[Path]) -> List[Path]:
    """Return the given bags, and those in the given folders.

    Raises:
        ConfigError: a folder has no bag in it, or a campaign further down.
    """
    bags: List[Path] = []
    for path in paths:
        if not path.is_dir():
            bags.append(path)
            continue
        campaigns = sorted(file.parent for file in path.rglob(MANIFEST))
        if campaigns:
            raise ConfigError(f'{path}: holds the results of a campaign in {campaigns[0]}; expected that folder')
        found = bags_in(path)
        if not found:
            raise ConfigError(f"{path}: no bag in this folder, and no campaign's results")
        bags += found
    return bags


def _distinct(bags: Sequence[BagTrial], notes: List[str]) -> List[BagTrial]:
    """Keep each trial once, and one definition of each test; add what is left out to `notes`."""
    first_of_test: Dict[str, BagTrial] = {}
    first_of_trial: Dict[str, BagTrial] = {}
    for bag in bags:
        test = first_of_test.setdefault(bag.trial.test.name, bag)
        same = first_of_trial.setdefault(bag.trial.model_dump_json(), bag)
        if bag.trial.test != test.trial.test:
            notes.append(
                f'{bag.data.bag}: defines {bag.trial.test.name} differently from {test.data.bag}; '
                f'expected one definition of a test; left out'
            )
        elif same is not bag:
            notes.append(f'{bag.data.bag}: the same trial as {same.data.bag}; expected each once; left out')
    return [bag for bag in first_of_trial.values() if bag.trial.test == first_of_test[bag.trial.test.name].trial.test]


def _differences(bags: Sequence[BagTrial], notes: List[str]) -> List[str]:
    """Return the keys of KEPT_APART in which trials differ, and add a note for each."""
    keys = []
    for key in KEPT_APART:
        values = sorted({str(getattr(bag.trial, key)) for bag in bags})
        if len(values) > 1:
            keys.append(key)
            notes.append(
                f'{bags[0].data.bag} and others: {key} is {" or ".join(values)}; trials with '
                f'different values are not pooled'
            )
    return keys
