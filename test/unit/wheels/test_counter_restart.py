"""A restart of both counters is told from motion; of a controller that has one of them only, it is not."""

import pytest

from diff_encoder_sim.wheels.odometry import ROUNDING_PULSES, is_restart

MOST = 3.0  # pulses by which the greatest acceleration changes an interval
LIMIT = MOST + ROUNDING_PULSES


def restarted(before, now, pulses_before=(0.0, 0.0), pulses=None):
    went = pulses or tuple(new - old for new, old in zip(now, before))
    return is_restart(before, now, went, pulses_before, (MOST, MOST))


def test_counters_that_jump_to_zero_were_restarted():
    assert restarted((1000, -400), (0, 0))


def test_the_wheels_may_have_turned_on_since_the_restart():
    assert restarted((1000, 1000), (20, 18), pulses_before=(20.0, 20.0))
    assert restarted((1000, 1000), (-20, 18), pulses_before=(-20.0, 20.0))
    assert not restarted((1000, 1000), (40, 40), pulses_before=(20.0, 20.0))


def test_a_wrap_at_the_end_of_the_range_is_none():
    """+127 of 8 bits is followed by -128, one pulse further."""
    assert not is_restart((127, 127), (-128, -128), (1, 1), (1.0, 1.0), (MOST, MOST))


@pytest.mark.parametrize('distance', [1, 2, 4, 5, 6, 50])
def test_it_is_seen_from_where_the_greatest_acceleration_no_longer_explains_it(distance):
    assert restarted((distance, distance), (0, 0)) == (distance > LIMIT)


def test_counters_that_stand_still_were_not_restarted():
    """As of a robot that runs against a wall near where its counters began."""
    assert not is_restart((30, 28), (30, 28), (0, 0), (40.0, 40.0), (5.0, 5.0))
