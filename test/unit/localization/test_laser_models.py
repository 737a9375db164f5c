"""The laser models and their rays against formulas and brute force in plain Python."""

import math

import numpy as np
import pytest

from amcl_world import pillar_room, simulated_scan
from diff_encoder_sim.base.laser_scan import Scan
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.laser_models import cast_ray, laser_model
from diff_encoder_sim.localization.occupancy_grid import FREE, OCCUPIED, distance_field

LASER_POSE = Pose2D(0.15, -0.05, 0.3)
RANGE_LIMIT_M = 3.5


def params(**changes):
    return AmclParams(**{**dict(laser_max_range=RANGE_LIMIT_M, laser_max_beams=10), **changes})


def turned_room():
    return pillar_room()._replace(origin=Pose2D(-3.0, -2.5, 0.4))


def particles_in_room(count, rng):
    return np.column_stack([rng.normal(0, 1.5, (count, 2)), rng.uniform(-np.pi, np.pi, count)])


def scan_with_gaps(grid, pose):
    scan = simulated_scan(grid, pose, ray_count=37, laser_pose_in_base=LASER_POSE)
    ranges = scan.ranges_m.copy()
    ranges[[4, 12]], ranges[8], ranges[16] = np.nan, np.inf, 0.1
    return scan._replace(ranges_m=ranges)


def brute_force_distances(occupied, resolution_m, max_distance_m):
    cells, centres = np.argwhere(occupied), np.moveaxis(np.indices(occupied.shape), 0, -1)
    apart = np.hypot(*np.moveaxis(centres[..., np.newaxis, :] - cells, -1, 0)) * resolution_m
    return apart.min(axis=-1, initial=max_distance_m)


def reference_rays(grid, scan, particle):
    """(range, whether it has returned, a function of a range to a point in the grid's frame) of every fourth ray."""
    laser = Pose2D(*particle).compose(LASER_POSE)
    for index in range(0, len(scan.ranges_m), 4):
        range_m, bearing_rad = scan.ranges_m[index], scan.angle_min_rad + index * scan.angle_increment_rad
        ray = laser.compose(Pose2D(0.0, 0.0, bearing_rad)).relative_to(grid.origin)
        has_returned = scan.range_min_m < range_m < RANGE_LIMIT_M
        if not math.isnan(range_m):
            yield range_m, has_returned, lambda along_m, ray=ray: ray.compose(Pose2D(along_m, 0.0, 0.0))[:2]


@pytest.mark.parametrize(
    ('model', 'rays', 'most', 'expected'),
    [
        ('likelihood_field', 1000, 180, 200),  # rounded down, as upstream
        ('likelihood_field_prob', 1000, 180, 167),
        ('likelihood_field', 20, 30, 20),
        ('likelihood_field_prob', 20, 30, 20),
    ],
)
def test_the_number_of_beams_is_upstreams(model, rays, most, expected):
    laser = laser_model(params(laser_model_type=model, laser_max_beams=most), pillar_room())
    assert len(laser.beams(Scan(0, 0.0, 0.001, 0.15, 6.0, np.ones(rays)), IDENTITY).ranges_m) == expected


@pytest.mark.parametrize('model', ['likelihood_field', 'beam'])
@pytest.mark.parametrize('dtype', [np.float32, np.float64])
def test_the_rays_that_count_are_those_within_limits(model, dtype):
    """A ray without a return counts in the beam model."""
    rng = np.random.default_rng(2)
    ranges_m = rng.uniform(-0.5, 7.0, 500).astype(dtype)
    ranges_m[rng.integers(0, 500, 60)] = rng.choice([np.nan, np.inf, -np.inf, 0.15, 3.5], 60)
    ranges_m.setflags(write=False)  # as of a message
    laser = laser_model(params(laser_model_type=model, laser_max_beams=167), pillar_room())
    beams = laser.beams(Scan(0, -2.0, 0.01, 0.15, 6.0, ranges_m), LASER_POSE)
    expected = [
        (range_m if 0.15 < range_m <= 3.5 else 3.5, 0.3 + (-2.0 + 0.03 * ray))
        for ray, range_m in enumerate(ranges_m[::3].astype(float).tolist())
        if not math.isnan(range_m) and (0.15 < range_m < 3.5 or model == 'beam')
    ]
    assert np.column_stack(beams[:2]) == pytest.approx(np.array(expected), rel=1e-14)
    assert beams[2:] == (LASER_POSE.x_m, LASER_POSE.y_m, 3.5)


@pytest.mark.parametrize(('shape', 'fraction'), [((1, 40), 0.1), ((17, 31), 0.0), ((30, 23), 0.003), ((30, 30), 0.3)])
def test_distances_are_exact(shape, fraction):
    for seed in range(2):
        occupied = np.random.default_rng(seed).random(shape) < fraction
        for limit_m in (0.3, 100.0):
            field = distance_field(occupied, 0.05, limit_m)
            expected_m = brute_force_distances(occupied, 0.05, limit_m)
            assert field.distances_m[field.indices] == pytest.approx(expected_m, rel=1e-12)
            assert field.distances_m[-1] == limit_m


@pytest.mark.parametrize('model', ['likelihood_field', 'likelihood_field_prob'])
def test_field_weights_are_the_formula(model):
    grid = turned_room()
    distances = brute_force_distances(grid.cells == OCCUPIED, grid.resolution_m, 2.0)
    scan = scan_with_gaps(grid, Pose2D(0.3, 0.2, 0.5))
    particles = particles_in_room(60, np.random.default_rng(3))
    laser = laser_model(params(laser_model_type=model), grid)
    likelihoods = laser.likelihoods(particles, laser.beams(scan, LASER_POSE), False)
    for particle, factor in zip(particles, likelihoods.factors):
        probabilities = []
        for range_m, has_returned, point_at in reference_rays(grid, scan, particle):
            if has_returned:
                column, row = np.floor(np.divide(point_at(range_m), grid.resolution_m)).astype(int)
                distance_m = distances[row, column] if grid.contains(row, column) else 2.0
                probabilities.append(0.95 * math.exp(-(distance_m**2) / (2 * 0.2**2)) + 0.05 / RANGE_LIMIT_M)
        assert len(probabilities) < 10
        if model == 'likelihood_field':
            assert factor == pytest.approx(1.0 + sum(p**3 for p in probabilities), rel=1e-9)
        else:
            log = math.log(factor) + likelihoods.log_scale
            assert log == pytest.approx(sum(math.log(p) for p in probabilities), rel=1e-8)


def test_a_product_of_many_unlikely_rays_does_not_vanish():
    grid = pillar_room()
    laser = laser_model(params(laser_model_type='likelihood_field_prob', laser_max_beams=1000, laser_z_rand=1e-4), grid)
    scan = simulated_scan(grid, Pose2D(0, 0, 0), ray_count=720)
    particles = particles_in_room(50, np.random.default_rng(0)) + [100.0, 0.0, 0.0]
    particles[:5, 0] -= 100.0
    factors = laser.likelihoods(particles, laser.beams(scan, LASER_POSE), False).factors
    assert factors.max() == 1.0 and np.isfinite(factors).all()


def test_beam_skipping_leaves_out_what_is_not_on_the_map():
    """With a third of the rays cut short, the weights are those of the other rays alone."""
    grid, pose = pillar_room(), Pose2D(0.2, -0.5, 0.0)
    settings = dict(laser_model_type='likelihood_field_prob', laser_max_beams=36, beam_skip_distance=0.2)
    skipping, plain = (laser_model(params(do_beamskip=skips, **settings), grid) for skips in (True, False))
    scan = simulated_scan(grid, pose, ray_count=36)
    scan.ranges_m[:12] = 0.9  # a person
    beams = skipping.beams(scan, IDENTITY)
    others = plain.beams(scan._replace(ranges_m=np.append(np.full(12, np.nan), scan.ranges_m[12:])), IDENTITY)
    particles = np.array(pose) + np.random.default_rng(4).normal(0, 0.02, (200, 3))
    for where, has_converged, counted in (
        (particles, True, others),
        (particles, False, beams),  # not before the filter has converged
        (particles + [50.0, 0.0, 0.0], True, beams),  # nor when nearly all rays disagree
    ):
        expected = plain.likelihoods(where, counted, True).factors
        assert skipping.likelihoods(where, beams, has_converged).factors == pytest.approx(expected)


def test_beam_weights_are_the_formula():
    grid, settings = turned_room(), params(laser_model_type='beam', laser_lambda_short=0.4)
    scan = scan_with_gaps(grid, Pose2D(0.3, 0.2, 0.5))
    particles = particles_in_room(40, np.random.default_rng(5))
    laser = laser_model(settings, grid)
    factors = laser.likelihoods(particles, laser.beams(scan, LASER_POSE), False).factors
    blocked = grid.cells != FREE
    for particle, factor in zip(particles, factors):
        expected = 1.0
        for range_m, has_returned, point_at in reference_rays(grid, scan, particle):
            measured_m = range_m if has_returned else RANGE_LIMIT_M
            ends = np.divide([*point_at(0.0), *point_at(RANGE_LIMIT_M)], 0.05)
            cast_m = 0.05 * cast_ray(blocked, *ends.tolist(), RANGE_LIMIT_M / 0.05)
            p = 0.95 * math.exp(-((measured_m - cast_m) ** 2) / (2 * 0.2**2))
            p += 0.1 * 0.4 * math.exp(-0.4 * measured_m) if measured_m < cast_m else 0.0
            p += 0.05 / RANGE_LIMIT_M if has_returned else 0.05
            expected += p**3
        assert factor == pytest.approx(expected, rel=1e-9)


def test_a_ray_that_meets_nothing_is_as_long_as_asked():
    free = np.zeros((9, 9), dtype=bool)
    assert cast_ray(free, 4.5, 4.5, 7.5, 4.5, 3.0) == 3.0
    assert cast_ray(free, 4.5, 4.5, 4.5, 4.5, 0.5) == 0.5
    assert cast_ray(free, 4.5, 4.5, 104.5, 4.5, 100.0) == 5.0  # the border ends it
    assert cast_ray(free, 4.5, 4.5, 4.5, -95.5, 100.0) == 5.0
    assert cast_ray(free, -50.0, 4.5, 9.0, 4.5, 59.0) == 1.0  # from off the map: at once
