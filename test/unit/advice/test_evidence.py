"""E-values of shares: their definition, their level under looks, and what is shown of them."""

import numpy as np
import pytest
from scipy import stats

from diff_encoder_sim.advice.encoder_search import (
    MOST_FORESEEN,
    TrialCounts,
    log_evidence_against,
    log_evidence_for,
    looks,
    monotone_fractions,
    more_trials,
    share_interval,
    shows_enough,
    shows_too_few,
)

SHARE, DOUBT = 0.8, 0.05


def evidence(function, within, trials, share=SHARE):
    return float(np.exp(function(np.array(within), np.array(trials), share)))


@pytest.mark.parametrize('truth', [0.3, 0.7, 0.8])
def test_evidence_of_what_is_not_so_has_a_mean_of_one_at_most(truth):
    within = np.arange(31)
    chances = stats.binom.pmf(within, 30, truth)
    mean = np.sum(chances * np.exp(log_evidence_for(within, np.full(31, 30), SHARE)))
    assert mean == pytest.approx(1.0) if truth == SHARE else mean < 1.0


@pytest.mark.heavy
@pytest.mark.parametrize('share', [0.5, 0.8, 0.95])
def test_a_look_after_every_trial_costs_no_error(share):
    rng = np.random.default_rng(1)
    within = np.cumsum(rng.uniform(size=(4000, 300)) < share, axis=1)
    trials = np.broadcast_to(np.arange(1, 301), within.shape)
    for function in (log_evidence_for, log_evidence_against):
        ever = np.any(function(within, trials, share) >= -np.log(DOUBT), axis=1)
        assert 0.01 < np.mean(ever) < DOUBT


def test_tests_share_the_doubt():
    good, bad = TrialCounts(19, 19), TrialCounts(11, 19)
    just_enough = 1.01 / evidence(log_evidence_against, *bad)
    assert shows_too_few([bad], SHARE, just_enough) and not shows_too_few([good, bad], SHARE, just_enough)
    assert shows_too_few([good, bad], SHARE, 2.0 * just_enough)


def test_one_looks_when_one_more_failure_is_forgiven():
    assert looks(SHARE, DOUBT, 60) == (17, 31, 41, 51, 59)
    assert looks(SHARE, DOUBT, 58) == (17, 31, 41, 51)
    for failures, trials in enumerate(looks(SHARE, DOUBT, 60)):
        assert shows_enough(TrialCounts(trials - failures, trials), SHARE, DOUBT)
        assert not shows_enough(TrialCounts(trials - 1 - failures, trials - 1), SHARE, DOUBT)


@pytest.mark.parametrize(
    'tests',
    [
        [TrialCounts(19, 20)],
        [TrialCounts(12, 20)],
        [TrialCounts(20, 20), TrialCounts(19, 20)],
        [TrialCounts(20, 20), TrialCounts(13, 20)],
    ],
)
def test_so_many_more_trials_of_that_fraction_decide(tests):
    more = more_trials(tests, SHARE, 0.01)
    assert 0 < more < MOST_FORESEEN

    def decided(after):
        foreseen = [TrialCounts(w + after * (w + 0.5) / (n + 1.0), n + after) for w, n in tests]
        return all(shows_enough(counts, SHARE, 0.01) for counts in foreseen) or shows_too_few(foreseen, SHARE, 0.01)

    assert decided(more) and not decided(more - 1)


@pytest.mark.parametrize('trials', [5, 20, 60, 400])
def test_the_interval_is_on_one_side_of_the_share_when_that_is_shown(trials):
    for within in range(0, trials + 1, max(1, trials // 20)):
        counts = TrialCounts(within, trials)
        low, high = share_interval(counts, 1.0 - DOUBT)
        assert 0.0 <= low <= within / trials <= high <= 1.0
        assert (low >= SHARE) == shows_enough(counts, SHARE, DOUBT)
        assert (high <= SHARE) == shows_too_few([counts], SHARE, DOUBT)


def test_fractions_that_fall_are_pooled():
    ranks = [TrialCounts(5, 10), TrialCounts(3, 10), TrialCounts(27, 30), TrialCounts(8, 10), TrialCounts(10, 10)]
    assert monotone_fractions(ranks) == [0.4, 0.4, 0.875, 0.875, 1.0]
    assert monotone_fractions(ranks[::-1]) == [pytest.approx(53 / 70)] * 5
    assert monotone_fractions([]) == []
