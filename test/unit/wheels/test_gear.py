"""Gear and play."""

import numpy as np
import pytest

from diff_encoder_sim.wheels.encoder import Gear, Play


def gear(ratio, backlash_rad, seed=1):
    return Gear(ratio, backlash_rad, np.random.default_rng(seed))


def test_play_is_taken_up_before_anything_follows():
    play = Play(0.2, 1.0)
    assert [play.follow(at) for at in (1.0, 1.1, 1.3, 1.2, 1.1, 1.0)] == pytest.approx([1.0, 1.0, 1.2, 1.2, 1.2, 1.1])


def test_the_motor_leads_by_half_of_the_play_in_either_direction():
    geared = gear(1.0, 0.1)
    geared.shaft_angle_rad(0.0)
    assert geared.shaft_angle_rad(1.0) == pytest.approx(1.05)
    assert geared.shaft_angle_rad(2.0) == pytest.approx(2.05)
    assert geared.shaft_angle_rad(1.5) == pytest.approx(1.45)
