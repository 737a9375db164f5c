import math

import numpy as np

from diff_encoder_sim.advice.answers import Requirement, along_goal
from diff_encoder_sim.base.se2 import Pose2D

REQUIREMENT = Requirement(0.8, 0.05, math.radians(3.0), 0.95)


def test_all_of_x_y_and_heading_must_be_within():
    errors = np.array([[0.05, -0.05, 0.05], [0.051, 0.0, 0.0], [0.0, -0.051, 0.0], [0.0, 0.0, -0.06]])
    assert REQUIREMENT.within(errors).tolist() == [True, False, False, False]


def test_an_unknown_error_is_not_within():
    assert not REQUIREMENT.within(np.array([[0.0, math.nan, 0.0]])).any()


def test_errors_turn_to_along_and_across_the_goals_heading():
    errors = along_goal(np.array([[1.0, 2.0, 0.3]]), Pose2D(5.0, 6.0, math.radians(90.0)))
    np.testing.assert_allclose(errors, [[2.0, -1.0, 0.3]], atol=1e-12)
