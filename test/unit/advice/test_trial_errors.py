import math

import numpy as np
import pytest

from diff_encoder_sim.advice.answers import Criterion, Requirement
from diff_encoder_sim.advice.trial_study import (
    ENCODER,
    LOCALIZATION,
    STOPPING,
    causes_alone,
    ends_of,
    is_within,
    reduced,
    truth_budget,
)
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.drives.topics import PoseSource
from synthetic_trials import trial_data

REQUIREMENT = Requirement(0.8, 0.05, math.radians(3.0), 0.95)
AHEAD = Pose2D(10.0, 0.0, 0.0)


def trial(estimate, truth, odometry=(0.0, 0.0, 0.0), **other):
    errors = {PoseSource.GLOBAL: estimate, PoseSource.WORLD: truth, PoseSource.ODOM: odometry}
    return trial_data(**other)._replace(errors={source: Pose2D(*error) for source, error in errors.items()})


def trials(count, seed=1, encoder_m=0.0):
    """Trials whose stop spreads by 3 mm along, and localization by 2 mm and `encoder_m` across."""
    rng = np.random.default_rng(seed)
    stop, fix, encoder = rng.normal(0.0, 0.003, count), rng.normal(0.001, 0.002, count), rng.normal(0.0, 1.0, count)
    return [
        trial((each, 0.0, 0.0), (each, side + encoder_m * step, 0.0), number=number)
        for number, (each, side, step) in enumerate(zip(stop, fix, encoder), 1)
    ]


def test_each_criterion_looks_at_its_own_error():
    one = trial((0.01, 0.0, 0.0), (0.06, 0.0, 0.0), (0.1, 0.0, 0.0))
    within = {criterion: is_within(one, criterion, REQUIREMENT) for criterion in Criterion}
    assert within == {Criterion.ODOMETRY: True, Criterion.POSE_ESTIMATE: True, Criterion.TRUTH: False}


def test_stopping_and_localization_make_the_true_pose():
    ends = ends_of(trials(50), AHEAD)
    np.testing.assert_allclose(ends.truth, ends.stopping + ends.localization, atol=1e-15)
    assert ends.stopping[:, 0].std() == pytest.approx(0.003, rel=0.3)
    assert ends.localization[:, 1].std() == pytest.approx(0.002, rel=0.3)


def test_the_encoders_part_is_what_the_finest_one_does_not_have():
    finest = ends_of(trials(2000), AHEAD)
    budget = truth_budget(ends_of(trials(2000, encoder_m=0.01), AHEAD), finest, finest, {})
    assert budget.parts[STOPPING].std[0] == pytest.approx(0.003, rel=0.1)
    assert budget.parts[LOCALIZATION].bias[1] == pytest.approx(0.001, abs=2e-4)
    assert budget.parts[ENCODER].std[1] == pytest.approx(0.01, rel=0.1)
    total = sum(part.variance for part in budget.parts.values()) + budget.rest.variance
    np.testing.assert_allclose(total, budget.found.variance)


def test_a_cause_that_is_switched_off_has_a_part_of_its_own():
    ends, finest = ends_of(trials(2000, encoder_m=0.01), AHEAD), ends_of(trials(2000), AHEAD)
    budget = truth_budget(ends, ends, finest, {'wheel slip': finest})
    assert budget.parts['wheel slip'].std[1] == pytest.approx(0.01, rel=0.1)
    assert budget.parts[ENCODER].std[1] == 0.0
    np.testing.assert_allclose(budget.rest.variance, 0.0, atol=3e-6)


def test_causes_can_be_looked_at_alone_and_with_less_of_them():
    ends = ends_of(trials(30), AHEAD)
    assert list(causes_alone(Criterion.POSE_ESTIMATE, {'SL': ends})) == [STOPPING]
    assert list(causes_alone(Criterion.TRUTH, {'SL': ends})) == [STOPPING, LOCALIZATION]
    np.testing.assert_allclose(reduced(Criterion.TRUTH, ends, {}), ends.truth, atol=1e-15)
    half = reduced(Criterion.TRUTH, ends, {STOPPING: 0.5})
    np.testing.assert_allclose(half, 0.5 * ends.stopping + ends.localization, atol=1e-15)
    np.testing.assert_allclose(reduced(Criterion.POSE_ESTIMATE, ends, {LOCALIZATION: 0.0}), ends.stopping, atol=1e-15)
