"""A number has bounds and a unit, and an error about it shows both."""

import math

import pytest
from typing_extensions import Annotated

from diff_encoder_sim.base.bounds import Between
from diff_encoder_sim.base.params import Params


@pytest.mark.parametrize(
    ('bounds', 'text'),
    [
        (Between(1e-3, 100.0, 'm'), '0.001 to 100 [m]'),
        (Between(-1e6, 1e6), '-1e6 to 1e6'),
        (Between(1e-6, 86_400.0, 's'), '1e-6 to 86400 [s]'),
        (Between(2, 2**63, 'counts', or_zero=True), '0, or 2 to 9223372036854775808 [counts]'),
    ],
)
def test_bounds_read_as_people_write_them(bounds, text):
    assert str(bounds) == text


def test_both_bounds_are_allowed_and_nothing_beyond():
    bounds = Between(1e-3, 100.0, 'm')
    assert all(map(bounds.allows, (1e-3, 1, 100.0)))
    assert not any(map(bounds.allows, (0, 0.0, 9e-4, 100.1, 10**400, -(10**400), math.nan, math.inf)))


def test_zero_may_turn_something_off():
    bounds = Between(1e-3, 100.0, 'm', or_zero=True)
    assert bounds.allows(0)
    assert not bounds.allows(1e-300)


def test_minus_zero_is_zero():
    class Scale(Params):
        scale: Annotated[float, Between(0.0, 1.0)]

    assert math.copysign(1.0, Scale.from_mapping({'scale': -0.0}, '').scale) == 1.0
