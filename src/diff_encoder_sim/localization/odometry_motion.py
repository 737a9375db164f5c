"""The motion model: Probabilistic Robotics, table 5.6, as upstream samples it.

A move between two odometry poses is a turn, a straight drive and another turn, each with Gaussian
noise that the alphas scale.
"""

from __future__ import annotations

import math
from typing import Callable, NamedTuple

import numpy as np

from diff_encoder_sim.base.se2 import Pose2D, wrap_angle, wrap_angles
from diff_encoder_sim.localization.amcl_params import AmclParams

# Below this distance [m] the direction between two poses is noise (a turn on the spot): upstream's.
SMALL_TRANSLATION_M = 0.01

# (particles (n, 3), previous and current base pose in odom, generator) -> moved particles (n, 3)
MotionModel = Callable[[np.ndarray, Pose2D, Pose2D, np.random.Generator], np.ndarray]


class Move(NamedTuple):
    """The three parts of an odometry move, or their standard deviations."""

    rotation1_rad: float
    translation_m: float
    rotation2_rad: float


def motion_model(params: AmclParams) -> MotionModel:
    """Build the model that odom_model_type names, with the parameters' alphas."""
    noise = diff_corrected_noise if params.odom_model_type == 'diff-corrected' else diff_noise

    def sample(particles: np.ndarray, previous: Pose2D, current: Pose2D, rng: np.random.Generator) -> np.ndarray:
        move = decompose(previous, current)
        return sample_motion(particles, move, noise(move, params), rng)

    return _about_the_axle(sample, params.axle_x) if params.axle_x else sample


def _about_the_axle(sample: MotionModel, axle_x_m: float) -> MotionModel:
    """Return a model of the base's motion from one of the axle's.

    A robot whose base frame is off the axle moves it sideways when it turns on the spot. To table 5.6 that is a turn of
    90 degrees, a drive, and a turn back, each with its noise, of which none happened.
    """
    axle_in_base = Pose2D(axle_x_m, 0.0, 0.0)

    def sample_base(particles: np.ndarray, previous: Pose2D, current: Pose2D, rng: np.random.Generator) -> np.ndarray:
        axles = _moved_ahead(particles, axle_x_m)
        moved = sample(axles, previous.compose(axle_in_base), current.compose(axle_in_base), rng)
        return _moved_ahead(moved, -axle_x_m)

    return sample_base


def _moved_ahead(poses: np.ndarray, by_m: float) -> np.ndarray:
    """Return (n, 3) poses moved along their own x axes."""
    moved = poses.copy()
    moved[:, 0] += by_m * np.cos(poses[:, 2])
    moved[:, 1] += by_m * np.sin(poses[:, 2])
    return moved


def decompose(previous: Pose2D, current: Pose2D) -> Move:
    """Compute the move between two base poses in odom (table 5.6, lines 2 to 4)."""
    x_m, y_m = current.x_m - previous.x_m, current.y_m - previous.y_m
    translation_m = math.hypot(x_m, y_m)
    rotation1_rad = wrap_angle(math.atan2(y_m, x_m) - previous.yaw_rad) if translation_m >= SMALL_TRANSLATION_M else 0.0
    return Move(rotation1_rad, translation_m, wrap_angle(current.yaw_rad - previous.yaw_rad - rotation1_rad))


def diff_corrected_noise(move: Move, params: AmclParams) -> Move:
    """Return a move's standard deviations [rad, m, rad]: the roots of table 5.6's variances."""
    return Move(*map(math.sqrt, _variances(move, params)))


def diff_noise(move: Move, params: AmclParams) -> Move:
    """Return a move's standard deviations [rad, m, rad] by upstream's older model `diff`, its default.

    It passes the variance of table 5.6 to a sampler that takes a standard deviation. Users have
    tuned their alphas on it, so upstream kept it and so does this; below 1 rad and 1 m, where
    the square is less than the root, it trusts odometry more than its alphas mean.
    """
    return _variances(move, params)


def _variances(move: Move, params: AmclParams) -> Move:
    """Return the variances of a move's parts (table 5.6, lines 5 to 7)."""
    turn1 = _turn_from_straight(move.rotation1_rad) ** 2
    turn2 = _turn_from_straight(move.rotation2_rad) ** 2
    drive = move.translation_m**2
    return Move(
        params.odom_alpha1 * turn1 + params.odom_alpha2 * drive,
        params.odom_alpha3 * drive + params.odom_alpha4 * (turn1 + turn2),
        params.odom_alpha1 * turn2 + params.odom_alpha2 * drive,
    )


def _turn_from_straight(rotation_rad: float) -> float:
    """Return the angle to the nearer of ahead and astern: reversing is as noisy as driving ahead."""
    return min(abs(wrap_angle(rotation_rad)), abs(wrap_angle(rotation_rad - math.pi)))


def sample_motion(particles: np.ndarray, move: Move, sigmas: Move, rng: np.random.Generator) -> np.ndarray:
    """Move each particle by its own noisy copy of a move (table 5.6, lines 5 to 11).

    Args:
        particles: (n, 3) base poses in the map.
        move: odometry's measurement.
        sigmas: standard deviations of its parts.
        rng: drawn from 3 n times, whatever the move, so that equal seeds stay in step.
    """
    normals = rng.standard_normal(particles.shape)
    rotation1 = move.rotation1_rad - sigmas.rotation1_rad * normals[:, 0]
    translation = move.translation_m - sigmas.translation_m * normals[:, 1]
    rotation2 = move.rotation2_rad - sigmas.rotation2_rad * normals[:, 2]
    direction = particles[:, 2] + rotation1
    moved = np.empty_like(particles)
    moved[:, 0] = particles[:, 0] + translation * np.cos(direction)
    moved[:, 1] = particles[:, 1] + translation * np.sin(direction)
    moved[:, 2] = wrap_angles(direction + rotation2)
    return moved
