"""What the trials of a test were asked to do, and on which map."""
from __future__ import annotations

from typing import Dict, Optional

from diff_encoder_sim.analysis.dataset import Dataset
from diff_encoder_sim.cli.run import package_folder
from diff_encoder_sim.errors import ConfigError
from diff_encoder_sim.experiments.definition import Trial, find_world
from diff_encoder_sim.mapping.map_files import load_map
from diff_encoder_sim.mapping.occupancy_grid import OccupancyGrid
from diff_encoder_sim.recording.reading import trial_of


def trial_of_each_test(dataset: Dataset) -> Dict[str, Trial]:
    """One for each test, as far as the manifest or a bag tells.

    Raises:
        ConfigError: a bag cannot be read.
    """
    found: Dict[str, Trial] = {}
    if dataset.manifest:
        configuration = dataset.manifest['configuration']
        for test in configuration['tests']:
            found[test['name']] = Trial.from_mapping(
                {'nav': configuration['nav'],
                 'test': {key: value for key, value in test.items() if key != 'files'}}, '')
    for trial in dataset.trials:
        asked = trial_of(trial.bag) if trial.bag and trial.test not in found else None
        if asked is not None:
            found[trial.test] = asked
    return found


def map_of(trial: Trial) -> Optional[OccupancyGrid]:
    """The map beside the trial's world; None where this machine has no such world, or no map."""
    try:
        world = find_world(trial.test.world, package_folder() / 'worlds')
        return load_map(world.with_suffix('.yaml'))
    except ConfigError:
        return None
