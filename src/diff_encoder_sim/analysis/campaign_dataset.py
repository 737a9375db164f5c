"""A campaign's dataset: trials.csv, and from the bags what happened on the way."""

from __future__ import annotations

from pathlib import Path
from typing import Dict, List, Sequence, Tuple, Union

from diff_encoder_sim.analysis.bag_trial import BagTrial, read_bag_trials, robot_of
from diff_encoder_sim.analysis.campaign_folder import Manifest, read_campaign
from diff_encoder_sim.analysis.dataset import Dataset, TrialData
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.campaign.folder import BAGS
from diff_encoder_sim.campaign.trial_row import TrialRow
from diff_encoder_sim.encoders.pulses import ppr_label


def campaign_dataset(folder: Path) -> Dataset:
    """Of a campaign's folder; bags may be missing, all or some.

    Raises:
        ConfigError: no trial is finished, or a file is not as the campaign wrote it.
    """
    manifest, rows, notes = read_campaign(folder)
    if not rows:
        raise ConfigError(f'{folder}: no trial is finished; expected some')
    bags, missing = _bags_of_rows(folder, rows)
    notes = notes + missing
    trials = [data_of(row) for row in rows]
    for index, bag in zip(bags, read_bag_trials(list(bags.values()))):
        trials[index], problem = _with_paths(trials[index], bag, manifest)
        notes += problem
    return Dataset(manifest.name, trials, notes, manifest.content, folder, manifest.robots[0], manifest.asked)


def data_of(row: TrialRow) -> TrialData:
    """A trial by its line in trials.csv alone: nothing is known about the way."""
    return TrialData(
        row.test,
        row.ppr,
        row.varied,
        row.trial,
        row.seed,
        row.outcome,
        row.reason,
        row.duration_s,
        row.distance_m,
        row.errors,
        {},
        None,
        None,
    )


def _bags_of_rows(folder: Path, rows: Sequence[TrialRow]) -> Tuple[Dict[int, Path], List[str]]:
    """Paths of the bags that are there, by the row's index, and notes of what is not."""
    bags = {index: folder / row.bag for index, row in enumerate(rows) if row.bag and (folder / row.bag).is_file()}
    notes = []
    if len(bags) < len(rows):
        notes.append(
            f'{folder / BAGS}: has bags of {len(bags)} of {len(rows)} trials; of the '
            f'others nothing is known about the way'
        )
    strangers = sorted(set((folder / BAGS).glob('*.bag')) - set(bags.values()))
    if strangers:
        notes.append(f'{strangers[0]}: not a bag of trials.csv ({len(strangers)} such); left out')
    return bags, notes


def _with_paths(trial: TrialData, bag: Union[BagTrial, str], manifest: Manifest) -> Tuple[TrialData, List[str]]:
    """The trial with what its bag tells, or why not."""
    if isinstance(bag, str):
        return trial, [bag]
    about, asked = bag.trial, manifest.asked[trial.test]
    expected = {'test': asked.test, 'number': trial.seed, 'nav': asked.nav}
    differing = [key for key, value in expected.items() if getattr(about, key) != value]
    if ppr_label(about.ppr) != trial.ppr:
        differing.append('ppr')
    if robot_of(about) not in manifest.robots:
        differing.append('wheel_diameter, wheel_separation')
    if differing:
        return trial, [
            f'{bag.data.bag}: its trial has another {", ".join(differing)}; expected '
            f'the trial of its line in trials.csv'
        ]
    return trial._replace(paths=bag.data.paths, tracks=bag.data.tracks, bag=bag.data.bag), []
