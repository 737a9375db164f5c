"""Paths of particles through resampling."""

import numpy as np

from diff_encoder_sim.localization.grid_slam import History


def test_paths_follow_the_parents():
    history = History()
    history.add(10, np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), np.array([0, 1]))
    history.add(20, np.array([[2.0, 0.0, 0.0], [3.0, 0.0, 0.0]]), np.array([1, 1]))
    history.add(30, np.array([[4.0, 0.0, 0.0], [5.0, 0.0, 0.0]]), np.array([1, 0]))
    assert [(step.stamp_ns, step.base_pose_in_map.x_m) for step in history.path(0)] == [(10, 1.0), (20, 3.0), (30, 4.0)]
    assert [step.base_pose_in_map.x_m for step in history.path(1)] == [1.0, 2.0, 5.0]
