"""The motion model of grid SLAM: odometry's move, and how far it may be wrong."""

from __future__ import annotations

import math

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D, wrap_angles
from diff_encoder_sim.localization.slam_params import GridSlamParams

# The noise across, as a fraction of the noise ahead: upstream's.
ACROSS_FRACTION = 0.3

# However little the robot moved, odometry is no more exact than this [m, m, rad].
LEAST_SIGMAS = np.array([0.001, 0.001, 0.0005])


def move_sigmas(move: Pose2D, params: GridSlamParams) -> np.ndarray:
    """Return (3,) standard deviations [m, m, rad] of a move, in the frame of the base before it."""
    ahead_m, across_m, turn_rad = abs(move.x_m), abs(move.y_m), abs(move.yaw_rad)
    by_turn_m = params.str_ * turn_rad
    across_noise = ACROSS_FRACTION * params.srr
    sigmas = np.array(
        [
            params.srr * ahead_m + across_noise * across_m + by_turn_m,
            params.srr * across_m + across_noise * ahead_m + by_turn_m,
            params.stt * turn_rad + params.srt * math.hypot(ahead_m, across_m),
        ]
    )
    limited: np.ndarray = np.maximum(sigmas, LEAST_SIGMAS)
    return limited


def apply_moves(particles: np.ndarray, moves: np.ndarray) -> np.ndarray:
    """Return (n, 3) poses after each particle's own move, (n, 3) or (3,) in its base frame."""
    moves = np.broadcast_to(moves, particles.shape)
    cosines, sines = np.cos(particles[:, 2]), np.sin(particles[:, 2])
    moved = np.empty_like(particles)
    moved[:, 0] = particles[:, 0] + cosines * moves[:, 0] - sines * moves[:, 1]
    moved[:, 1] = particles[:, 1] + sines * moves[:, 0] + cosines * moves[:, 1]
    moved[:, 2] = wrap_angles(particles[:, 2] + moves[:, 2])
    return moved
