"""A few kills. The long run: `.venv/bin/python test/fuzz/campaign_kills.py --kills 100 --seed 2`."""

import numpy as np
import pytest

from campaign_kills import IDLE, KilledCampaigns


@pytest.mark.timeout(240)
def test_campaigns_that_are_killed_at_random_moments_end_with_equal_results(tmp_path):
    campaigns = KilledCampaigns(IDLE, tmp_path, np.random.default_rng(2))
    campaigns.run(3)
    assert campaigns.problems == []
    assert campaigns.seen['results compared'] >= 1
