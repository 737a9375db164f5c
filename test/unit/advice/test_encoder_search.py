"""The search for the lowest sufficient encoder, and the binomial tests of its trials."""

import pytest
from scipy import stats

from diff_encoder_sim.advice.encoder_search import (
    Asked,
    RankAnswer,
    TrialCounts,
    fraction_interval,
    judged,
    monotone_fractions,
    more_trials,
    search,
)
from diff_encoder_sim.analysis.within_tolerance import Sufficiency

RANKS, TRIALS, SHARE = 12, 39, 0.8
YES, NO, UNDECIDED = Sufficiency.YES, Sufficiency.NO, Sufficiency.UNDECIDED


def searched(within, guess):
    """Search by {question: within(rank)} of SMT's trials; SL's never fail. Return the answers and the tested ranks."""
    tested = []

    def run(rank):
        tested.append(rank)
        return {
            question: [TrialCounts(TRIALS, TRIALS), TrialCounts(of_rank(rank), TRIALS)]
            for question, of_rank in within.items()
        }

    return search(RANKS, run, dict.fromkeys(within, guess), Asked(SHARE)), tested


@pytest.mark.parametrize('lowest', [0, 1, 4, 6, RANKS - 1])
@pytest.mark.parametrize('guess', [0, 5, RANKS - 1])
def test_a_step_is_found_from_any_guess(lowest, guess):
    found, tested = searched({'truth': lambda rank: TRIALS * (rank >= lowest)}, guess)
    assert found['truth'] == RankAnswer(YES, lowest, lowest - 1 if lowest else None)
    assert len(tested) == len(set(tested)) <= (3 if guess == lowest else 7)


def test_the_highest_rank_may_not_suffice_or_not_decide():
    found, tested = searched({'truth': lambda rank: 20}, 3)
    assert found['truth'] == RankAnswer(NO, insufficient=RANKS - 1) and tested == [RANKS - 1]
    found, tested = searched({'truth': lambda rank: 35}, 3)
    assert found['truth'][:4] == (UNDECIDED, None, None, RANKS - 1) and tested == [RANKS - 1]
    assert 30 < found['truth'].more_trials < 300


def test_an_undecided_neighbour_is_reported_and_not_recommended():
    found, _ = searched({'truth': lambda rank: 20 if rank < 4 else 35 if rank == 4 else TRIALS}, 5)
    assert found['truth'][:4] == (YES, 5, None, 4) and found['truth'].more_trials > 0


def test_questions_share_their_trials():
    found, tested = searched({'truth': lambda rank: TRIALS * (rank >= 6), 'estimate': lambda rank: TRIALS}, 6)
    assert (found['truth'].rank, found['estimate'].rank) == (6, 0) and len(tested) == len(set(tested))


@pytest.mark.parametrize('failures', [0, 2])
def test_the_fewest_trials_show_the_fraction_although_some_fail(failures):
    asked = Asked()
    trials, doubt = asked.fewest_trials(failures), asked.doubt
    assert judged([TrialCounts(trials - failures, trials)], SHARE, doubt) is YES
    assert judged([TrialCounts(trials - 1 - failures, trials - 1)], SHARE, doubt) is UNDECIDED
    assert (0.8**trials <= doubt < 0.8 ** (trials - 1)) == (failures == 0)


@pytest.mark.parametrize('within', [0, 10, 20, 28, 30])
def test_verdicts_are_those_of_binomial_tests(within):
    for doubt in (0.05, 0.3):
        p_enough = stats.binomtest(within, 30, SHARE, 'greater').pvalue
        p_too_few = stats.binomtest(within, 30, SHARE, 'less').pvalue
        expected = YES if p_enough <= doubt else NO if p_too_few <= doubt else UNDECIDED
        assert judged([TrialCounts(within, 30)], SHARE, doubt) is expected


def test_tests_share_the_doubt_of_a_refusal():
    few, all_within = TrialCounts(19, 30), TrialCounts(30, 30)
    doubt = 1.01 * stats.binomtest(19, 30, SHARE, 'less').pvalue
    assert judged([few], SHARE, doubt) is NO and judged([few, all_within], SHARE, doubt) is UNDECIDED
    assert judged([few, all_within], SHARE, 2.0 * doubt) is NO


@pytest.mark.parametrize('tests', [[(19, 20)], [(12, 20)], [(20, 20), (19, 20)], [(20, 20), (13, 20)]])
def test_more_trials_of_the_same_fraction_decide(tests):
    counts = [TrialCounts(*each) for each in tests]
    more = more_trials(counts, SHARE, 0.01)
    assert more_trials(counts, SHARE, 1e-300) is None

    def kind(after):
        grown = [(w + after * (w + 0.5) / (n + 1.0), n + after) for w, n in tests]
        return judged([TrialCounts(*each) for each in grown], SHARE, 0.01)

    assert kind(more) is not UNDECIDED and kind(more - 1) is UNDECIDED


@pytest.mark.parametrize('within', [0, 24])
def test_the_interval_is_clopper_and_pearsons(within):
    expected = stats.binomtest(within, 30).proportion_ci(0.9, 'exact')
    assert fraction_interval(TrialCounts(within, 30), 0.95) == pytest.approx(tuple(expected))


def test_fractions_that_fall_are_pooled():
    ranks = [TrialCounts(5, 10), TrialCounts(3, 10), TrialCounts(27, 30), TrialCounts(8, 10), TrialCounts(10, 10)]
    assert monotone_fractions(ranks) == [0.4, 0.4, 0.875, 0.875, 1.0]
    assert monotone_fractions(ranks[::-1]) == [pytest.approx(53 / 70)] * 5
    assert monotone_fractions([]) == []
