"""The search for the lowest sufficient encoder, and the binomial tests of its trials."""

from types import SimpleNamespace

import pytest
from scipy import stats

from diff_encoder_sim.advice.answers import Answer, Kind, Requirement
from diff_encoder_sim.advice.encoder_search import TrialCounts, fewest_trials, judged, more_trials, search
from diff_encoder_sim.analysis.summaries import Sufficiency

RANKS, TRIALS, SHARE = 12, 39, 0.8
YES, NO, UNDECIDED = Sufficiency.YES, Sufficiency.NO, Sufficiency.UNDECIDED
CANDIDATES = [SimpleNamespace(label=str(rank), counts=float(rank)) for rank in range(RANKS)]


def searched(guess, **within):
    """Search by within(rank) of SMT's trials; SL's never fail. Return the answers and the tested ranks."""
    tested = []

    def run(rank):
        tested.append(rank)
        every = TrialCounts(TRIALS, TRIALS)
        return {name: [every, TrialCounts(of_rank(rank), TRIALS)] for name, of_rank in within.items()}

    return search(CANDIDATES, run, dict.fromkeys(within, guess), Requirement(SHARE)), tested


@pytest.mark.parametrize('lowest', [0, 1, 4, 6, RANKS - 1])
@pytest.mark.parametrize('guess', [0, 5, RANKS - 1])
def test_a_step_is_found_from_any_guess(lowest, guess):
    found, tested = searched(guess, truth=lambda rank: TRIALS * (rank >= lowest))
    below = lowest - 1.0 if lowest else None
    assert found['truth'] == Answer('truth', Kind.FROM, float(lowest), (below, float(lowest)), str(lowest))
    assert len(tested) == len(set(tested)) <= (3 if guess == lowest else 7)


def test_the_highest_rank_may_not_suffice_or_not_decide():
    found, tested = searched(3, truth=lambda rank: 20)
    assert found['truth'] == Answer('truth', Kind.NOT_THE_LIMIT) and tested == [RANKS - 1]
    found, tested = searched(3, truth=lambda rank: 35)
    assert found['truth'].kind is Kind.UNDECIDED and tested == [RANKS - 1]
    assert 30 < found['truth'].more_trials < 300


def test_an_undecided_neighbour_is_reported_and_not_recommended():
    found, _ = searched(5, truth=lambda rank: 20 if rank < 4 else 35 if rank == 4 else TRIALS)
    answer = found['truth']
    assert (answer.encoder, answer.interval, answer.undecided) == ('5', (None, 5.0), '4') and answer.more_trials > 0


def test_criteria_share_their_trials():
    found, tested = searched(6, truth=lambda rank: TRIALS * (rank >= 6), pose_estimate=lambda rank: TRIALS)
    assert (found['truth'].encoder, found['pose_estimate'].encoder) == ('6', '0')
    assert len(tested) == len(set(tested))


@pytest.mark.parametrize('failures', [0, 2])
def test_the_fewest_trials_show_the_fraction_although_some_fail(failures):
    trials, doubt = fewest_trials(Requirement(), failures), Requirement().doubt
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
    assert TrialCounts(within, 30).interval(0.95) == pytest.approx(tuple(expected))
