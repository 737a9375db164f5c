"""The errors that a part of a claim is about."""

from diff_encoder_sim.analysis.paper.claims import pairs_of_pprs
from diff_encoder_sim.analysis.quantities import X
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome
from paper_datasets import cell


def test_pairs_are_of_equal_trials():
    first = cell('SL', '40', 'odom', [(1.0, 0.0, 0.0), (2.0, 0.0, 0.0), (3.0, 0.0, 0.0)])
    second = cell('SL', '4096', 'odom', [(0.1, 0.0, 0.0), (0.2, 0.0, 0.0)])
    second[0] = second[0]._replace(outcome=Outcome.TORN)
    (one,) = pairs_of_pprs(
        {('SL', '40'): first, ('SL', '4096'): second}, PoseSource.ODOM, ['SL'], [('40', '4096')], [X]
    )
    assert [values.tolist() for values in one.values] == [[2.0], [0.2]]
