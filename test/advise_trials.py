"""The advise command with trials that take no time: the true pose is within 0.05 m of the goal from 60 counts on.

Not a test: test_advise.py runs it, and workers import it.
"""

from pathlib import Path

from diff_encoder_sim.advice import odometry_answer, odometry_study
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.cli.advise import main
from diff_encoder_sim.drives.topics import PoseSource
from diff_encoder_sim.drives.trial_definition import Outcome
from diff_encoder_sim.trials.trials_csv import TrialRow


def trials(setups, robot_file):
    """Results that depend on the encoders alone."""
    return [trial(plan) for plan, *_ in setups]


def trial(plan):
    """One of them."""
    if plan.bag:
        Path(plan.bag).write_bytes(b'a bag')
    estimate = Pose2D(0.01, 0.02, 0.0)
    truth = Pose2D(0.01, 0.02 + 1.8 / plan.trial.ppr.left, 0.0)
    errors = {PoseSource.ODOM: truth, PoseSource.AMCL: None, PoseSource.GLOBAL: estimate, PoseSource.WORLD: truth}
    return TrialRow('', '', (), 0, 0, Outcome.SUCCEEDED, '', 50.0, errors, 20.0)


if __name__ == '__main__':
    # Few draws, which have their own tests.
    odometry_answer.DRAWS, odometry_answer.FINE_DRAWS, odometry_answer.BUDGET_DRAWS = 100, 3000, 100
    odometry_study.LISTED_DRAWS, odometry_study.DRAWS = 40, 3000
    # Workers know it by its module's name, not as part of the script that was started.
    from advise_trials import trials as importable_trials

    main(run=importable_trials)
