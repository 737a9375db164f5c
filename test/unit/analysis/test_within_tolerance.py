"""The fraction of trials within tolerance, against counts and intervals worked out by hand."""

import pytest

from diff_encoder_sim.analysis.within_tolerance import COMPARED_POSES, Sufficiency, fewest_trials, fraction_within
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome
from paper_datasets import IN, OUT, TURNED, cell, rows, trial


def test_a_fraction_is_of_the_trials_with_a_pose_and_joint_over_position_and_heading():
    trials = cell('SL', '90', 'odom', [IN, IN, OUT, TURNED, None])
    trials.append(trial('SL', '90', 6, outcome=Outcome.TORN, odom=IN))
    fraction = fraction_within(trials, PoseSource.ODOM)
    assert fraction[:4] == (4, 2, 3, 3)
    assert fraction_within(trials, PoseSource.WORLD) is None


def test_odometry_is_compared_with_the_goal_and_with_the_truth():
    # Both end 0.3 m from the goal, at the same place; in the last, the headings are on two sides of half a turn.
    trials = [
        trial('SL', '90', 1, odom=OUT, world=OUT),
        trial('SL', '90', 2, odom=IN, world=OUT),
        trial('SL', '90', 3, odom=(0.0, 0.0, 179.5), world=(0.0, 0.0, -179.5)),
        trial('SL', '90', 4, odom=IN),
    ]
    at_goal, at_truth = (pose.fraction(trials) for pose in COMPARED_POSES[2:])
    assert (at_goal.within, at_goal.trials) == (2, 4)
    assert (at_truth.within, at_truth.trials) == (2, 3)


@pytest.mark.parametrize(
    ('inside', 'sufficiency'),
    [
        (30, Sufficiency.YES),
        (29, Sufficiency.YES),
        (28, Sufficiency.UNDECIDED),
        (20, Sufficiency.UNDECIDED),
        (19, Sufficiency.NO),
        (0, Sufficiency.NO),
    ],
)
def test_a_fraction_is_sufficient_where_wilsons_interval_says_so(inside, sufficiency):
    # 28 of 30: 0.787 to 0.982; 29: 0.833 to 0.994; 20: 0.488 to 0.808; 19: 0.455 to 0.781.
    fraction = fraction_within(cell('SL', '90', 'odom', rows(inside, 30 - inside)), PoseSource.ODOM)
    assert fraction.sufficiency is sufficiency


def test_sixteen_trials_can_show_the_fraction_and_fifteen_cannot():
    assert fewest_trials() == 16  # n / (n + 1.96^2) >= 0.8 from n = 15.4 on
