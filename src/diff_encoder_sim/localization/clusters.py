"""The pose estimate from the particles: the heaviest cluster's mean, and the spread of them all.

As upstream's pf_cluster_stats: a cluster is a set of connected bins of the histogram.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Tuple

import numpy as np

from diff_encoder_sim.base.compiled import compiled
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.histogram import cluster_labels


class ParticleStatistics(NamedTuple):
    """Mean, spread and clusters of a particle set, in the map frame."""

    mean: Pose2D  # of the heaviest cluster
    covariance: np.ndarray  # 3x3 over (x [m], y [m], yaw [rad]), of all particles
    cluster_weight: float  # the heaviest cluster's fraction of the weight, 0 to 1
    cluster_count: int


def particle_statistics(particles: np.ndarray, weights: np.ndarray) -> ParticleStatistics:
    """Cluster particles (n, 3) with weights (n,), sum 1."""
    labels = cluster_labels(particles)
    cluster_weights = np.bincount(labels, weights)
    heaviest = int(np.argmax(cluster_weights))
    in_heaviest = labels == heaviest
    mean, covariance = mean_and_covariance(particles[in_heaviest], weights[in_heaviest])
    if len(cluster_weights) > 1:
        covariance = mean_and_covariance(particles, weights).covariance
    return ParticleStatistics(mean, covariance, float(cluster_weights[heaviest]), len(cluster_weights))


@compiled
def _mean_unit_vector(particles: np.ndarray, weights: np.ndarray) -> Tuple[float, float]:
    """Return the mean of (cos yaw, sin yaw) with weights of sum 1.

    One after another: numpy 1.24's cosine of a strided array differed in the last bit from one run
    to the next, by where the array lay in memory.
    """
    cos_sum, sin_sum = 0.0, 0.0
    for index in range(len(weights)):
        cos_sum += weights[index] * math.cos(particles[index, 2])
        sin_sum += weights[index] * math.sin(particles[index, 2])
    return cos_sum, sin_sum


class MeanAndCovariance(NamedTuple):
    """First and second moments of weighted poses."""

    mean: Pose2D
    covariance: np.ndarray  # 3x3; as upstream publishes it, nothing between yaw and x or y


def mean_and_covariance(particles: np.ndarray, weights: np.ndarray) -> MeanAndCovariance:
    """Compute the moments of particles (n, 3) with weights (n,) of any sum above 0.

    Yaw by circular statistics: the direction of the mean unit vector, and -2 ln of its length,
    which is the variance of a wrapped normal distribution.
    """
    weights = weights / weights.sum()
    x_m, y_m = float((weights * particles[:, 0]).sum()), float((weights * particles[:, 1]).sum())
    off_x, off_y = particles[:, 0] - x_m, particles[:, 1] - y_m
    cos_mean, sin_mean = _mean_unit_vector(particles, weights)
    covariance = np.zeros((3, 3))
    covariance[0, 0] = (weights * off_x * off_x).sum()
    covariance[0, 1] = covariance[1, 0] = (weights * off_x * off_y).sum()
    covariance[1, 1] = (weights * off_y * off_y).sum()
    # Equal headings may give a length of 1 + 1e-16, opposite ones 0: neither has a logarithm that
    # could be published.
    length = min(max(math.hypot(cos_mean, sin_mean), 1e-12), 1.0)
    covariance[2, 2] = -2.0 * math.log(length)
    return MeanAndCovariance(Pose2D(x_m, y_m, math.atan2(sin_mean, cos_mean)), covariance)
