"""Trajectories of velocity samples."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.navigation.dwa_kernels import last_point, roll_out, rollout_params, sample_step_count
from navigation_scenes import dwa_params
from rolled_out import rolled_out


def test_the_trajectory_is_upstreams():
    """Points no farther apart than the granularities, the start in and the end out."""
    points = rolled_out(dwa_params(), IDENTITY, 0.4, 0.5)
    assert len(points) == 28  # 0.68 m / 0.025 m
    assert points[0].tolist() == [0.0, 0.0, 0.0, 1.0, 0.0]
    assert points[-1, 2] == pytest.approx(0.5 * 1.7 * 27 / 28)
    radius_m = 0.4 / 0.5
    assert points[-1, :2] == pytest.approx(
        (radius_m * math.sin(points[-1, 2]), radius_m * (1 - math.cos(points[-1, 2]))), abs=0.02
    )
    assert points[:, 3:] == pytest.approx(np.column_stack([np.cos(points[:, 2]), np.sin(points[:, 2])]))


def test_without_dwa_the_trajectory_accelerates():
    params = rollout_params(dwa_params(use_dwa=False, acc_lim_x=0.5))
    points = np.empty((17, 5))
    roll_out(params, IDENTITY, (0.0, 0.0), (0.4, 0.0), 17, points)
    assert points[3, 0] == pytest.approx((0.05 + 0.1 + 0.15) * 0.1)


def test_slow_and_fast_samples_have_no_trajectory():
    params = rollout_params(dwa_params(min_vel_trans=0.1, min_vel_theta=0.2))
    samples = [(0.4, 0.5), (0.0, 0.0), (0.0, -0.3), (0.05, 0.1), (0.46, 0.0), (0.3, 0.0)]
    # Neither fast enough nor turning, then neither, then too fast.
    assert [sample_step_count(params, *sample) for sample in samples] == [28, 0, 6, 0, 0, 21]


@pytest.mark.parametrize('sample', [(0.4, 0.5), (0.4, 0.0), (0.0, -0.9), (-0.2, 1e-9), (0.01, 0.0), (0.3, 1e-300)])
def test_the_last_point_in_closed_form_is_that_of_the_rollout(sample):
    pose, params = Pose2D(1.0, -2.0, 0.7), dwa_params()
    points = rolled_out(params, pose, *sample)
    assert last_point(rollout_params(params), pose, *sample, len(points)) == pytest.approx(points[-1, :3], abs=1e-13)
