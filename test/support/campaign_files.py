"""A small campaign for tests, its rows, and its folder after some of its trials."""

import shutil

import pytest
import yaml

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.trials.campaign_loading import load_campaign
from diff_encoder_sim.trials.results import ResultStore
from diff_encoder_sim.trials.trials_csv import TrialRow
from places import ROOT

SMALL = {'name': 'small', 'tests': ['SL', 'SMT'], 'ppr': [40, 90], 'trials': 2}
NOISE = 'simulator.lidar.noise'
TWO_NOISES = {'tests': ['SL'], 'vary': {NOISE: [0.01, 0.03]}}
RUN = {'versions': {'numpy': '1'}, 'commit': None}


def package_copy(folder):
    """What a campaign reads of the package, to be changed."""
    for name in ('config', 'worlds', 'urdf'):
        shutil.copytree(ROOT / name, folder / name)
    return folder


def campaign_file(folder, **changes):
    """The small campaign with changes; a change to None takes the key out."""
    content = {key: value for key, value in {**SMALL, **changes}.items() if value is not None}
    path = folder / 'small.yaml'
    path.write_text(yaml.safe_dump(content))
    return path


def small_campaign(folder, **changes):
    return load_campaign(str(campaign_file(folder, **changes)), ROOT)


def row_of_trial(trial, bag='', **changes):
    """Some result; another for each trial."""
    errors = {source: Pose2D(trial.position / 3, -1e-17, 0.1 * number) for number, source in enumerate(PoseSource)}
    ending = Outcome.SUCCEEDED, '', 49.05 + trial.position, errors, 20.000000000000004, 1.25, bag
    return TrialRow(*trial.identity(), *ending)._replace(**changes)


def run(campaign, folder):
    """Finish all trials as a campaign does, and return the table."""
    kill(folder, campaign)
    with ResultStore(folder, campaign, RUN) as store:
        return store.finish().read_bytes()


def kill(folder, campaign, count=None):
    """A folder as it is when a campaign was killed after `count` trials, or after all."""
    with ResultStore(folder, campaign, RUN) as store:
        for trial in store.pending()[:count]:
            if trial.bag:
                (store.folder / trial.bag).write_bytes(b'bag')
            store.append(row_of_trial(trial, trial.bag))


def refusal(folder, campaign, **options):
    """The one line with which the folder is refused."""
    with pytest.raises(ConfigError) as caught:
        ResultStore(folder, campaign, RUN, **options)
    assert '\n' not in str(caught.value)
    return str(caught.value)
