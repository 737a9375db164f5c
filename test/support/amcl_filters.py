"""Filters with the parameters of the paper, and how to run them over a drive."""

import numpy as np

from amcl_world import START, pillar_room
from diff_encoder_sim.base.se2 import IDENTITY
from diff_encoder_sim.localization.amcl import Amcl
from diff_encoder_sim.localization.amcl_params import AmclParams

# The paper's table 2.
PAPER = dict(
    max_particles=3000,
    laser_max_range=3.5,
    laser_max_beams=180,
    laser_z_hit=0.9,
    laser_z_short=0.05,
    laser_z_rand=0.5,
    laser_sigma_hit=0.2,
    kld_err=0.02,
    transform_tolerance=0.4,
)


NO_MOTION_LIMIT = dict(update_min_d=0.0, update_min_a=0.0)


def amcl(seed=0, grid=None, **changes):
    settings = {
        **PAPER,
        'initial_pose_x': START.x_m,
        'initial_pose_y': START.y_m,
        'initial_pose_a': START.yaw_rad,
        **changes,
    }
    return Amcl(AmclParams(**settings), grid or pillar_room(), np.random.default_rng(seed))


def noisy(scan, rng):
    return scan._replace(ranges_m=scan.ranges_m + 0.03 * rng.standard_normal(len(scan.ranges_m)))


def run(filter_, drive, seed=0):
    """The estimates of a whole drive, None where there was none."""
    rng = np.random.default_rng([seed, 1])
    return [filter_.update(odom_pose, noisy(scan, rng), IDENTITY) for _, odom_pose, scan in drive]
