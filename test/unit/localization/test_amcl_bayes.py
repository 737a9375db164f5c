"""AMCL against the exact Bayes filter over a fine grid of poses.

What makes the comparison fair:
- Both filter the same thing: the same prior, odometry and scans, the odometry model diff-corrected
  (table 5.6; independent Gaussian turn, drive and turn) and upstream's likelihood-field weights.
  Those are no probabilities, but the posterior that they define is as exact as any. The weights
  are checked against plain Python in test_laser_models.py.
- The grid filter (test/support/grid_filter.py) has no error of its own that would count: its cells are
  below a third of every spread, and its window reaches five standard deviations.
- AMCL gets 10,000 particles, no KLD limit and no recovery: those trade accuracy for time or for
  finding a lost robot, on purpose. What is left is sampling error, which falls with the root of
  the number of particles.
- The room is uneven, so the posterior has one peak; AMCL's estimate, the heaviest cluster, is then
  the posterior's mean.
"""

import math

import numpy as np
import pytest

from amcl_world import moved, pillar_room, simulated_scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.amcl import Amcl
from diff_encoder_sim.localization.amcl_params import AmclParams
from grid_filter import GridFilter

PARAMS = dict(
    min_particles=10_000,
    max_particles=10_000,
    laser_max_beams=91,
    update_min_d=0.1,
    recovery_alpha_slow=0.0,
    recovery_alpha_fast=0.0,
    odom_model_type='diff-corrected',
    odom_alpha1=0.03,
    odom_alpha2=0.03,
    odom_alpha3=0.03,
    odom_alpha4=0.03,
    initial_pose_x=1.0,
    initial_pose_y=-0.7,
    initial_pose_a=1.9,
    initial_cov_xx=0.03,
    initial_cov_yy=0.03,
    initial_cov_aa=0.015,
)
TRUE_START = Pose2D(0.9, -0.6, 1.8)
STEPS = 8


def drive():
    """(true base pose in the map, base in odom, scan) of each step along an arc."""
    rng = np.random.default_rng(5)
    grid = pillar_room()
    true_pose, odom_pose = TRUE_START, IDENTITY
    for _ in range(STEPS):
        yield odom_pose, simulated_scan(grid, true_pose, rng, sigma_m=0.03)
        true_pose = moved(true_pose, 0.25, 0.35)
        odom_pose = moved(odom_pose, 0.24, 0.33)


@pytest.fixture(scope='module')
def exact():
    """The grid filter's (mean, spread) where AMCL gives an estimate from its weights."""
    params = AmclParams(**PARAMS)
    grid_filter = GridFilter(params, pillar_room())
    results, previous = [], None
    for index, (odom_pose, scan) in enumerate(drive()):
        if previous is not None:
            grid_filter.predict(previous, odom_pose)
        grid_filter.correct(scan)
        previous = odom_pose
        if (index + 1) % params.resample_interval == 0:
            results.append((grid_filter.mean(), grid_filter.spread()))
    return results


@pytest.mark.parametrize('seed', range(2))
def test_mean_and_spread_are_the_exact_filters(exact, seed):
    amcl = Amcl(AmclParams(**PARAMS), pillar_room(), np.random.default_rng(seed))
    estimates = [amcl.update(odom_pose, scan, IDENTITY) for odom_pose, scan in drive()][1::2]
    for estimate, (mean, spread) in zip(estimates, exact):
        error = np.subtract(estimate.base_pose_in_map, mean)
        assert np.hypot(error[0], error[1]) < 0.01
        assert abs(math.degrees(np.angle(np.exp(1j * error[2])))) < 0.5
        assert np.sqrt(np.diag(estimate.covariance)) == pytest.approx(spread, rel=0.2)
