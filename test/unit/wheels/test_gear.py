"""Gear and play."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from diff_encoder_sim.wheels.encoder import Gear, Play


def gear(ratio, backlash_rad, seed=1):
    return Gear(ratio, backlash_rad, np.random.default_rng(seed))


def test_the_motor_turns_by_the_ratio():
    assert gear(34.014, 0.0).shaft_angle_rad(2.0) == 34.014 * 2.0


def test_play_is_taken_up_before_anything_follows():
    play = Play(0.2, 1.0)
    assert [play.follow(at) for at in (1.0, 1.1, 1.3, 1.2, 1.1, 1.0)] == pytest.approx([1.0, 1.0, 1.2, 1.2, 1.2, 1.1])


@given(st.lists(st.floats(-10, 10), min_size=1, max_size=30), st.floats(0.001, 1.0), st.integers(0, 9))
def test_the_motor_is_never_farther_than_half_of_the_play_from_the_wheel(angles, backlash_rad, seed):
    geared = gear(2.0, backlash_rad, seed)
    for angle in angles:
        assert abs(geared.shaft_angle_rad(angle) / 2.0 - angle) <= 0.5 * backlash_rad + 1e-12


def test_the_motor_leads_by_half_of_the_play_in_either_direction():
    geared = gear(1.0, 0.1)
    geared.shaft_angle_rad(0.0)
    assert geared.shaft_angle_rad(1.0) == pytest.approx(1.05)
    assert geared.shaft_angle_rad(2.0) == pytest.approx(2.05)
    assert geared.shaft_angle_rad(1.5) == pytest.approx(1.45)


@given(st.floats(0.0, 1.0), st.lists(st.floats(0.0, 0.3), min_size=1, max_size=30))
def test_what_turns_one_way_is_seen_to(backlash_rad, steps):
    geared = gear(30.0, backlash_rad)
    shown = [geared.shaft_angle_rad(angle) for angle in np.cumsum(steps)]
    assert (np.diff(shown) >= -1e-12).all()
