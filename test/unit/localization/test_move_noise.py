"""Odometry's moves and their noise."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.slam_params import apply_moves, move_sigmas
from slam_room import params


def test_sigmas_of_a_move():
    given = params(srr=0.1, srt=0.2, str=0.3, stt=0.4)
    assert move_sigmas(Pose2D(1.0, 0.0, 0.0), given) == pytest.approx([0.1, 0.03, 0.2])
    assert move_sigmas(Pose2D(-1.0, 0.0, -0.5), given) == pytest.approx([0.25, 0.18, 0.4])
    assert (move_sigmas(IDENTITY, given) > 0.0).all()


def test_moves_are_in_the_particles_frames():
    moved = apply_moves(np.array([[1.0, 2.0, 0.5 * math.pi], [0.0, 0.0, 3.0]]), np.array([0.5, 0.1, 0.3]))
    assert moved[0] == pytest.approx([0.9, 2.5, 0.5 * math.pi + 0.3])
    assert moved[1, 2] == pytest.approx(3.3 - 2.0 * math.pi)
