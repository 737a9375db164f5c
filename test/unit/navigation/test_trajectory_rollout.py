"""Trajectories of velocity samples."""

import math

import numpy as np
import pytest

from diff_encoder_sim.navigation.trajectory_rollout import roll_out, roll_out_all, step_count


def test_the_trajectory_is_upstreams():
    """Points no farther apart than the granularities, the start in and the end out."""
    steps = step_count(0.4, 0.5, 1.7, 0.025, 0.1)
    assert steps == 28  # 0.68 m / 0.025 m
    points = np.empty((steps, 3))
    roll_out(np.zeros(3), np.zeros(2), np.array([0.4, 0.5]), steps, 1.7, np.ones(2), False, points)
    assert points[0].tolist() == [0.0, 0.0, 0.0]
    assert points[-1, 2] == pytest.approx(0.5 * 1.7 * 27 / 28)
    radius_m = 0.4 / 0.5
    assert points[-1, :2] == pytest.approx(
        (radius_m * math.sin(points[-1, 2]), radius_m * (1 - math.cos(points[-1, 2]))), abs=0.02
    )


def test_without_dwa_the_trajectory_accelerates():
    points = np.empty((17, 3))
    roll_out(np.zeros(3), np.array([0.0, 0.0]), np.array([0.4, 0.0]), 17, 1.7, np.array([0.5, 3.0]), True, points)
    assert points[3, 0] == pytest.approx((0.05 + 0.1 + 0.15) * 0.1)


def test_all_samples_roll_out_as_each_does():
    samples = np.array([[0.4, 0.5], [0.0, 0.0], [0.0, -0.3], [0.05, 0.1], [0.46, 0.0], [0.3, 0.0]])
    pose, twist, accelerations = np.array([1.0, -2.0, 0.7]), np.array([0.2, -0.1]), np.array([0.7, 4.9])
    for accelerates in (False, True):
        points, steps = roll_out_all(
            pose, twist, samples, np.array([1.7, 0.025, 0.1]), np.array([0.1, 0.45, 0.2]), accelerations, accelerates
        )
        # Neither fast enough nor turning, then neither, then too fast.
        assert steps.tolist() == [28, 0, 6, 0, 0, 21]
        for index in np.flatnonzero(steps):
            alone = np.empty((steps[index], 3))
            roll_out(pose, twist, samples[index], steps[index], 1.7, accelerations, accelerates, alone)
            assert (points[index, : steps[index]] == alone).all()
