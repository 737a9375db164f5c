"""Answers, requirements, budgets and limits."""

import math

import numpy as np
import pytest

from diff_encoder_sim.advice.answers import (
    Answer,
    Budget,
    Criterion,
    Kind,
    Limit,
    Requirement,
    added,
    along_goal,
    limits,
    part_of,
)
from diff_encoder_sim.base.se2 import Pose2D

RADIUS = Limit('wheel radius', 'SL', 1, 0.047, 0.05, 0.025)


@pytest.mark.parametrize(
    ('answer', 'text'),
    [
        (
            Answer(Criterion.ODOMETRY, Kind.FROM, 347.0, (340.0, 350.0), '360'),
            'at least 347 counts per revolution (between 340 and 350); smallest tested: 360 PPR',
        ),
        (
            Answer(Criterion.TRUTH, Kind.FROM, 40.0, (20.0, 40.0), '40', more_trials=70, undecided='28'),
            (
                'at least 40 counts per revolution; 20 do not suffice; '
                '28 PPR undecided, about 70 more trials of each test would decide'
            ),
        ),
        (
            Answer(Criterion.ODOMETRY, Kind.NOT_THE_LIMIT, 512.0, limits=[RADIUS]),
            (
                'the encoder is not the limit: wheel radius makes 47 of 50 mm across in SL; '
                'if wheel radius made 25 mm: at least 512 counts'
            ),
        ),
        (
            Answer(Criterion.TRUTH, Kind.UNDECIDED, more_trials=30),
            'undecided, about 30 more trials of each test would decide',
        ),
    ],
)
def test_an_answer_in_words(answer, text):
    assert str(answer) == text


REQUIREMENT = Requirement(0.8, 0.05, math.radians(3.0), 0.95)


def test_all_of_x_y_and_heading_must_be_within():
    errors = np.array(
        [[0.05, -0.05, 0.05], [0.051, 0.0, 0.0], [0.0, -0.051, 0.0], [0.0, 0.0, -0.06], [0.0, math.nan, 0.0]]
    )
    assert REQUIREMENT.within(errors).tolist() == [True, False, False, False, False]


def test_errors_turn_to_along_and_across_the_goals_heading():
    errors = along_goal(np.array([[1.0, 2.0, 0.3]]), Pose2D(5.0, 6.0, math.radians(90.0)))
    np.testing.assert_allclose(errors, [[2.0, -1.0, 0.3]], atol=1e-12)


def test_parts_and_rest_add_up_to_what_is_found():
    rng = np.random.default_rng(1)
    one, other = rng.normal(1.0, 2.0, (4000, 3)), rng.normal(-3.0, 1.0, (4000, 3))
    budget = Budget({'one': part_of(one), 'other': part_of(other)}, part_of(one + other))
    parts = [*budget.parts.values(), budget.rest]
    np.testing.assert_allclose(sum(part.bias for part in parts), budget.found.bias, atol=1e-12)
    np.testing.assert_allclose(sum(part.variance for part in parts), budget.found.variance, atol=1e-12)
    assert np.all(np.abs(budget.rest.variance) < 0.2)  # independent causes leave none but by chance


def test_what_a_cause_adds_is_the_difference_of_pairs():
    rng = np.random.default_rng(2)
    without = rng.normal(0.5, 1.0, (3000, 3))
    part = added(without + rng.normal(0.1, 2.0, (3000, 3)), without)
    np.testing.assert_allclose(part.bias, 0.1, atol=0.15)
    np.testing.assert_allclose(part.variance, 4.0, rtol=0.15)


def spread(sd_m, axis, n=2000):
    errors = np.zeros((n, 3))
    errors[:, axis] = np.random.default_rng(axis).normal(0.0, sd_m, n)
    return errors


def test_what_takes_more_than_half_of_a_tolerance_is_a_limit_the_worst_first():
    alone = {
        'small': {'SL': spread(0.01, 0)},
        'large': {'SL': spread(0.03, 1), 'SMT': spread(0.001, 1)},
        'largest': {'SL': spread(0.02, 0), 'SMT': spread(0.5, 2)},
    }
    found = limits(alone, REQUIREMENT)
    assert [(limit.cause, limit.test, limit.axis) for limit in found] == [('largest', 'SMT', 2), ('large', 'SL', 1)]
    # 80 % of normal errors are within 1.28 standard deviations.
    assert found[1].error == pytest.approx(1.28 * 0.03, rel=0.05)
    assert (found[1].tolerance, found[1].reduced_to) == (0.05, 0.025)
