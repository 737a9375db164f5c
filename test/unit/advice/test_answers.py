"""Answers, requirements, budgets and limits."""

import math

import numpy as np
import pytest

from diff_encoder_sim.advice import answers
from diff_encoder_sim.advice.answers import Answer, Criterion, Kind, Reach, Requirement, Travel
from diff_encoder_sim.base.se2 import Pose2D


def test_an_answer_in_words():
    """test_advise.py and test_advice_page.py have the others."""
    answer = Answer(Criterion.TRUTH, Kind.FROM, 347.0, (340.0, 350.0), '360', more_trials=70, undecided='28')
    assert str(answer).split('; ') == [
        'at least 347 counts per wheel turn (between 340 and 350)',
        'smallest tested: 360 counts',
        '28 counts undecided, about 70 more trials of each test would decide',
    ]


@pytest.mark.parametrize(
    ('counts', 'text'),
    [
        (360.0, '360 counts per wheel turn = 90 lines x4 on the wheel, or 12 lines x4 on a motor with a 7.5:1 gear'),
        (347.0, '348 counts per wheel turn = 87 lines x4 on the wheel, or 12 lines x4 on a motor with a 7.3:1 gear'),
        (48.0, '48 counts per wheel turn = 12 lines x4 on the wheel'),
        (9.1, '12 counts per wheel turn = 3 lines x4 on the wheel'),
    ],
)
def test_counts_are_lines_and_a_gear_that_suffice(counts, text):
    answer = Answer(Criterion.ODOMETRY, Kind.FROM, counts)
    assert answer.lines == text and answer._replace(kind=Kind.NOT_THE_LIMIT).lines == ''


@pytest.mark.parametrize(
    ('error', 'axis', 'text'),
    [
        (2.47, 'across', '2.5 m sideways after 20 m, 50 mm allowed'),
        (0.0532, 'along', '53 mm along the path after 20 m, 50 mm allowed'),
        (2471.0, 'across', '2500 m sideways after 20 m, 50 mm allowed'),
        (0.073, 'heading', '4.2 degrees of heading after 20 m, 2.86479 degrees allowed'),
    ],
)
def test_a_reach_is_in_metres_millimetres_or_degrees_of_two_digits(error, axis, text):
    reach = Reach('SL', axis, error, 0.05, Travel(20.0, 0.0), Travel(5.93, 0.0))
    assert str(reach).startswith(f'{text}: the encoder is not the limit; ') and str(reach).endswith(' hold for 5.9 m')
    assert str(reach._replace(after=Travel(0.0, 10.0 * math.pi))).partition(' after ')[2].startswith('5 turns, ')
    assert str(Travel(0.001, 2.0 * math.pi)) == '1 turn'


def test_all_of_x_y_and_heading_must_be_within():
    errors = [[0.05, -0.05, 0.05], [0.051, 0.0, 0.0], [0.0, -0.051, 0.0], [0.0, 0.0, -0.06], [0.0, math.nan, 0.0]]
    assert Requirement().within(np.array(errors)).tolist() == [True, False, False, False, False]


def test_errors_turn_to_along_and_across_the_goals_heading():
    errors = answers.along_goal(np.array([[1.0, 2.0, 0.3]]), Pose2D(5.0, 6.0, math.radians(90.0)))
    np.testing.assert_allclose(errors, [[2.0, -1.0, 0.3]], atol=1e-12)


def test_what_a_cause_adds_is_the_difference_of_pairs():
    rng = np.random.default_rng(2)
    without = rng.normal(0.5, 1.0, (3000, 3))
    part = answers.added(without + rng.normal(0.1, 2.0, (3000, 3)), without)
    np.testing.assert_allclose(part.bias, 0.1, atol=0.15)
    np.testing.assert_allclose(part.variance, 4.0, rtol=0.15)


def spread(sd_m, axis):
    return np.random.default_rng(axis).normal(0.0, sd_m, (2000, 1)) * np.eye(3)[axis]


def test_what_takes_more_than_half_of_a_tolerance_is_a_limit_the_worst_first():
    small = {('small', 'SL'): spread(0.01, 0)}
    large = {('large', 'SL'): spread(0.03, 1), ('large', 'SMT'): spread(0.001, 1)}
    largest = {('largest', 'SL'): spread(0.02, 0), ('largest', 'SMT'): spread(0.5, 2)}
    found = answers.limits({**small, **large, **largest}, Requirement())
    named = [(limit.cause, limit.test, limit.axis) for limit in found]
    assert named == [('largest', 'SMT', 'heading'), ('large', 'SL', 'across')]
    # 80 % of normal errors are within 1.28 standard deviations.
    assert found[1].error == pytest.approx(1.28 * 0.03, rel=0.05)
    assert (found[1].tolerance, found[1].reduced_to) == (0.05, 0.025)


def test_the_worst_of_small_causes_is_halved_if_they_are_too_much_together():
    small = {('small', 'SL'): spread(0.01, 0), ('smaller', 'SL'): spread(0.005, 0)}
    assert answers.limits(small, Requirement()) == []
    (limit,) = answers.limits(small, Requirement(), is_some_cause=True)
    assert limit.cause == 'small' and limit.reduced_to == pytest.approx(0.5 * limit.error)
