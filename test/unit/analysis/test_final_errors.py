"""Final errors of several trials: which trials have one, and how many are within tolerance."""

from diff_encoder_sim.analysis.final_errors import count_within_all, equal_trials, final_errors, with_final_error
from diff_encoder_sim.analysis.quantities import YAW, X
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome
from paper_datasets import IN, OUT, TURNED, cell, trial


def test_failed_trials_have_a_final_error_and_torn_ones_have_not():
    trials = [trial('SL', '40', number, outcome, odom=IN) for number, outcome in enumerate(Outcome)]
    found = with_final_error(trials, PoseSource.ODOM)
    assert [one.outcome for one in found] == [outcome for outcome in Outcome if outcome is not Outcome.TORN]
    assert with_final_error(trials, PoseSource.WORLD) == []


def test_errors_are_in_the_unit_of_the_quantity():
    trials = cell('SL', '40', 'odom', [IN, None, TURNED])
    assert final_errors(trials, PoseSource.ODOM, YAW).round(9).tolist() == [1.0, 4.0]
    assert final_errors(trials, PoseSource.WORLD, YAW).shape == (0,)


def test_a_trial_is_within_where_all_quantities_are():
    trials = cell('SL', '40', 'odom', [IN, OUT, TURNED])
    assert count_within_all(trials, PoseSource.ODOM) == 1
    assert count_within_all(trials, PoseSource.ODOM, [X]) == 3


def test_equal_trials_come_in_one_order():
    first, second = cell('SL', '40', 'odom', [IN, None, IN, IN]), cell('SL', '90', 'odom', [IN, IN, IN])
    pairs = equal_trials(first, second[::-1], PoseSource.ODOM)
    assert [[one.trial for one in of_one] for of_one in pairs] == [[1, 3], [1, 3]]
