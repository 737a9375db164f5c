"""Makes a dataset of a campaign: trials.csv, and the errors along the path from the bags."""

from __future__ import annotations

from pathlib import Path
from typing import Dict, List, Sequence, Tuple, Union

from diff_encoder_sim.analysis.bag_trial import BagTrial, read_bag_trials, robot_of
from diff_encoder_sim.analysis.campaign_folder import Manifest, read_campaign
from diff_encoder_sim.analysis.dataset import Dataset, TrialData
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.drives.bag_source import bags_in
from diff_encoder_sim.trials.campaign_cells import VARIANT
from diff_encoder_sim.trials.results import BAGS, TrialRow


def campaign_dataset(folder: Path) -> Dataset:
    """Read a campaign's folder; some or all bags may be missing.

    Raises:
        ConfigError: no trial is finished, or a file is not as the campaign wrote it.
    """
    manifest, rows, notes = read_campaign(folder)
    if not rows:
        raise ConfigError(f'{folder}: no trial is finished; expected at least one')
    bags, missing = _bags_of_rows(folder, rows)
    notes = notes + missing
    trials = [data_of(row) for row in rows]
    for index, bag in zip(bags, read_bag_trials(list(bags.values()))):
        trials[index], problem = _with_paths(trials[index], bag, manifest)
        notes += problem
    return Dataset(manifest.name, trials, notes, manifest.content, folder, manifest.robots[0], manifest.requested)


def data_of(row: TrialRow) -> TrialData:
    """Convert a line of trials.csv; without its bag nothing is known about the path."""
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
    """Return the paths of the existing bags by the row's index, and notes of missing and foreign bags."""
    bags = {index: folder / row.bag for index, row in enumerate(rows) if row.bag and (folder / row.bag).is_file()}
    notes = []
    if len(bags) < len(rows):
        notes.append(
            f'{folder / BAGS}: has bags of {len(bags)} of {len(rows)} trials; the others have no errors along the path'
        )
    foreign = sorted(set(bags_in(folder / BAGS)) - set(bags.values()))
    if foreign:
        notes.append(f'{foreign[0]}: not a bag of trials.csv ({len(foreign)} such); left out')
    return bags, notes


def _with_paths(trial: TrialData, bag: Union[BagTrial, str], manifest: Manifest) -> Tuple[TrialData, List[str]]:
    """Add the errors along the path from the bag, or return a note why not."""
    if isinstance(bag, str):
        return trial, [bag]
    differing = _differences(trial, bag, manifest)
    if differing:
        return trial, [
            f'{bag.data.bag}: differs in {", ".join(differing)} from its line in trials.csv; expected the same trial'
        ]
    return trial._replace(paths=bag.data.paths, tracks=bag.data.tracks, bag=bag.data.bag), []


def _differences(trial: TrialData, bag: BagTrial, manifest: Manifest) -> List[str]:
    """Return the keys in which the bag's trial differs from the trial of trials.csv."""
    recorded, requested = bag.trial, manifest.requested[trial.test]
    expected = {'test': requested.test, 'number': trial.seed, 'nav': requested.nav}
    differing = [key for key, value in expected.items() if getattr(recorded, key) != value]
    if recorded.encoder_label != trial.ppr:
        differing.append('ppr')
    if recorded.variant != dict(trial.varied).get(VARIANT, ''):
        differing.append(VARIANT)
    if robot_of(recorded) not in manifest.robots:
        differing.append('wheel_diameter, wheel_separation')
    return differing
