"""Bins of poses, and the clusters that they form."""

import math

import numpy as np

from diff_encoder_sim.localization.histogram import particle_statistics


def test_bins_that_touch_are_one_cluster_and_a_gap_parts_them():
    chain = np.column_stack([np.arange(0.25, 5.0, 0.5), np.arange(0.25, 5.0, 0.5), np.zeros(10)])
    weights = np.full(10, 0.1)
    assert particle_statistics(chain, weights).cluster_count == 1
    gap = np.delete(chain, 5, axis=0)
    assert particle_statistics(gap, np.full(9, 1 / 9)).cluster_count == 2


def test_clusters_are_those_of_a_plain_flood_fill():
    rng = np.random.default_rng(6)
    particles = np.column_stack([rng.uniform(-4, 4, (150, 2)), rng.uniform(-np.pi, np.pi, 150)])
    weights = rng.random(150)
    bins = {tuple(key) for key in np.floor(particles / [0.5, 0.5, math.pi / 18]).astype(int)}
    clusters = 0
    while bins:
        clusters += 1
        pending = [bins.pop()]
        while pending:
            x, y, yaw = pending.pop()
            near = {
                (x + i, y + j, (yaw + k + 18) % 36 - 18) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1)
            } & bins
            bins -= near
            pending += near
    assert particle_statistics(particles, weights / weights.sum()).cluster_count == clusters
