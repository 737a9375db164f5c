"""Means by rank, against all of them made and sorted."""

import numpy as np
import pytest

from diff_encoder_sim.analysis import paired_statistics as pairwise_means
from diff_encoder_sim.analysis.paired_statistics import mean_of_rank


def all_means(values):
    rows, columns = np.triu_indices(len(values))
    return np.sort(0.5 * (values[rows] + values[columns]))


@pytest.mark.heavy
@pytest.mark.parametrize('most_at_once', [1, 10, 100_000])
@pytest.mark.parametrize(
    'values',
    [
        np.random.default_rng(0).normal(size=40),
        0.1 * np.round(3.0 * np.random.default_rng(1).normal(size=60)),  # whole pulses: many are equal
        np.random.default_rng(2).standard_cauchy(size=30),
        np.zeros(20),
        np.array([1.5]),
    ],
    ids=['normal', 'whole pulses', 'heavy tails', 'equal', 'one'],
)
def test_every_rank_is_that_of_all_means_sorted(monkeypatch, values, most_at_once):
    monkeypatch.setattr(pairwise_means, 'MOST_AT_ONCE', most_at_once)
    ascending = np.sort(values)
    means = all_means(values)
    assert [mean_of_rank(ascending, rank) for rank in range(len(means))] == means.tolist()


def test_no_more_means_are_made_at_once_than_allowed(monkeypatch):
    made = []
    original = pairwise_means._means
    monkeypatch.setattr(pairwise_means, '_means', lambda *arguments: made.append(original(*arguments)) or made[-1])
    ascending = np.sort(np.random.default_rng(0).normal(size=2000))
    mean_of_rank(ascending, 1_000_000)
    assert len(made) == 1 and len(made[0]) <= pairwise_means.MOST_AT_ONCE
