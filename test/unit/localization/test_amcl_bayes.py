"""AMCL against the exact Bayes filter over a fine grid of poses (test/support/grid_filter.py).

Both filter the same thing: prior, odometry, scans, the odometry model diff-corrected and upstream's likelihood-field
weights, which test_laser_models.py checks. AMCL gets 10,000 particles, no KLD limit and no recovery: what is left is
sampling error. The room is uneven, so the posterior has one peak: the heaviest cluster's mean is the posterior's.
"""

import math

import numpy as np
import pytest

from amcl_world import moved, pillar_room, simulated_scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.amcl import Amcl
from diff_encoder_sim.localization.amcl_params import AmclParams
from grid_filter import GridFilter

FIXED = dict(min_particles=10_000, max_particles=10_000, recovery_alpha_slow=0.0, recovery_alpha_fast=0.0)
ALPHAS = {f'odom_alpha{number}': 0.03 for number in (1, 2, 3, 4)}
START = dict(initial_pose_x=1.0, initial_pose_y=-0.7, initial_pose_a=1.9)
SPREAD = dict(initial_cov_xx=0.03, initial_cov_yy=0.03, initial_cov_aa=0.015)
UPDATE = dict(laser_max_beams=91, update_min_d=0.1, odom_model_type='diff-corrected')
PARAMS = AmclParams(**FIXED, **ALPHAS, **START, **SPREAD, **UPDATE)
TRUE_START = Pose2D(0.9, -0.6, 1.8)
STEPS = 8


def drive():
    """(base in odom, scan) of each step along an arc."""
    rng, grid = np.random.default_rng(5), pillar_room()
    true_pose, odom_pose = TRUE_START, IDENTITY
    for _ in range(STEPS):
        yield odom_pose, simulated_scan(grid, true_pose, rng, sigma_m=0.03)
        true_pose, odom_pose = moved(true_pose, 0.25, 0.35), moved(odom_pose, 0.24, 0.33)


@pytest.fixture(scope='module')
def exact():
    """The grid filter's (mean, spread) where AMCL gives an estimate from its weights."""
    grid_filter, results, previous = GridFilter(PARAMS, pillar_room()), [], None
    for odom_pose, scan in drive():
        if previous is not None:
            grid_filter.predict(previous, odom_pose)
        grid_filter.correct(scan)
        previous = odom_pose
        results.append((grid_filter.mean(), grid_filter.spread()))
    return results[PARAMS.resample_interval - 1 :: PARAMS.resample_interval]


@pytest.mark.parametrize('seed', range(2))
def test_mean_and_spread_are_the_exact_filters(exact, seed):
    amcl = Amcl(PARAMS, pillar_room(), np.random.default_rng(seed))
    estimates = [amcl.update(odom_pose, scan, IDENTITY) for odom_pose, scan in drive()][1::2]
    for estimate, (mean, spread) in zip(estimates, exact):
        error = np.subtract(estimate.base_pose_in_map, mean)
        assert np.hypot(error[0], error[1]) < 0.01
        assert abs(math.degrees(np.angle(np.exp(1j * error[2])))) < 0.5
        assert np.sqrt(np.diag(estimate.covariance)) == pytest.approx(spread, rel=0.2)
