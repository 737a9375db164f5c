"""Campaign folders with made-up rows and small bags, to be analysed."""

import pytest

from campaign_files import RUN, row_of_trial
from diff_encoder_sim.analysis.results_loading import load_results
from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.trials.results import ResultStore
from trial_bags import write_bag


def finish(campaign, folder, count=None):
    """Run a campaign's trials: rows that are made up, and bags that are of the trials."""
    with ResultStore(folder, campaign, RUN) as store:
        for job in store.pending()[:count]:
            write_bag(folder / job.bag, job.definition())
            store.append(row_of_trial(job, job.bag))
        store.finish()
    return folder


def refusal(*paths):
    """The one line with which these paths are refused."""
    with pytest.raises(ConfigError) as caught:
        load_results(paths)
    assert '\n' not in str(caught.value)
    return str(caught.value)
