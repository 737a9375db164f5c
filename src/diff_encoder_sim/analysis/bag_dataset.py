"""The dataset of bags that belong to no campaign: everything recomputed from what was recorded."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Dict, List, Sequence

from diff_encoder_sim.analysis.bag_trial import BagTrial, read_bag_trials, robot_of
from diff_encoder_sim.analysis.campaign_folder import MANIFEST
from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.base.errors import ConfigError

log = logging.getLogger(__name__)

# Bags of trials that differ in these are not pooled: it is shown as varied.
KEPT_APART = ('nav', 'wheel_diameter', 'wheel_separation')


def bag_dataset(paths: Sequence[Path]) -> Dataset:
    """Of bags, and of folders of bags.

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
    """The bags named, and those in the folders named.

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
            raise ConfigError(f'{path}: has a campaign in {campaigns[0]}; expected that folder')
        found = sorted(path.rglob('*.bag'))
        if not found:
            raise ConfigError(f"{path}: no .bag file in this folder, and no campaign's results")
        bags += found
    return bags


def _distinct(bags: Sequence[BagTrial], notes: List[str]) -> List[BagTrial]:
    """Each trial once, and each test by one definition; `notes` get what is left out."""
    first_of_test: Dict[str, BagTrial] = {}
    first_of_trial: Dict[str, BagTrial] = {}
    for bag in bags:
        test = first_of_test.setdefault(bag.trial.test.name, bag)
        same = first_of_trial.setdefault(bag.trial.model_dump_json(), bag)
        if bag.trial.test != test.trial.test:
            notes.append(
                f'{bag.data.bag}: another {bag.trial.test.name} than in {test.data.bag}; '
                f'expected one definition of a test; left out'
            )
        elif same is not bag:
            notes.append(f'{bag.data.bag}: the same trial as {same.data.bag}; expected each once; left out')
    return [bag for bag in first_of_trial.values() if bag.trial.test == first_of_test[bag.trial.test.name].trial.test]


def _differences(bags: Sequence[BagTrial], notes: List[str]) -> List[str]:
    """In which keys trials differ that are not pooled; `notes` get them."""
    keys = []
    for key in KEPT_APART:
        values = sorted({str(getattr(bag.trial, key)) for bag in bags})
        if len(values) > 1:
            keys.append(key)
            notes.append(
                f'{bags[0].data.bag} and others: {key} is {" or ".join(values)}; trials '
                f'are pooled only where it is the same'
            )
    return keys
