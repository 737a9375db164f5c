"""Products of many rays, and beam skipping."""

import numpy as np
import pytest

from amcl_world import pillar_room, simulated_scan
from diff_encoder_sim.base.se2 import Pose2D
from diff_encoder_sim.localization.laser_models import laser_model
from laser_model_cases import LASER_POSE, params, particles_in_room


def test_a_product_of_many_unlikely_rays_does_not_vanish():
    grid = pillar_room()
    laser = laser_model(params(laser_model_type='likelihood_field_prob', laser_max_beams=1000, laser_z_rand=1e-4), grid)
    scan = simulated_scan(grid, Pose2D(0, 0, 0), ray_count=720)
    particles = particles_in_room(50, np.random.default_rng(0)) + [100.0, 0.0, 0.0]
    particles[:5, 0] -= 100.0
    factors = laser.likelihoods(particles, laser.beams(scan, LASER_POSE), False).factors
    assert factors.max() == 1.0 and np.isfinite(factors).all()


def person_in_front(grid, pose):
    """A scan with a third of its rays cut short by what is not on the map."""
    scan = simulated_scan(grid, pose, ray_count=36)
    ranges = scan.ranges_m.copy()
    ranges[:12] = 0.9
    return scan._replace(ranges_m=ranges)


def test_beam_skipping_leaves_out_what_is_not_on_the_map():
    """With a third of the rays cut short, the weights are those of the other rays alone."""
    grid, pose = pillar_room(), Pose2D(0.2, -0.5, 0.0)
    settings = dict(laser_model_type='likelihood_field_prob', laser_max_beams=36, beam_skip_distance=0.2)
    skipping = laser_model(params(do_beamskip=True, **settings), grid)
    plain = laser_model(params(**settings), grid)
    scan = person_in_front(grid, pose)
    seen = scan.ranges_m.copy()
    seen[:12] = np.nan
    rng = np.random.default_rng(4)
    particles = np.array(pose) + rng.normal(0, 0.02, (200, 3))
    no_laser_offset = Pose2D(0, 0, 0)
    beams = skipping.beams(scan, no_laser_offset)
    skipped = skipping.likelihoods(particles, beams, True)
    others = plain.likelihoods(particles, plain.beams(scan._replace(ranges_m=seen), no_laser_offset), True)
    assert skipped.factors == pytest.approx(others.factors)
    # Not before the filter has converged, and not when nearly all rays disagree.
    everything = plain.likelihoods(particles, beams, True)
    assert skipping.likelihoods(particles, beams, False).factors == pytest.approx(everything.factors)
    elsewhere = particles + [50.0, 0.0, 0.0]
    assert skipping.likelihoods(elsewhere, beams, True).factors == pytest.approx(
        plain.likelihoods(elsewhere, beams, True).factors
    )
