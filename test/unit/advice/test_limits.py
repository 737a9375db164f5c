import math

import numpy as np
import pytest

from diff_encoder_sim.advice.answers import Requirement, limits

REQUIREMENT = Requirement(0.8, 0.05, math.radians(3.0), 0.95)


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
