"""The whole filter: that it converges, recovers and repeats itself."""

import math

import numpy as np
import pytest

from amcl_filters import amcl, noisy, run
from amcl_world import START, moved, pillar_room, simulated_scan
from diff_encoder_sim.base.params import with_changes
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, wrap_angle


@pytest.mark.heavy
@pytest.mark.parametrize('model', ['likelihood_field', 'beam'])
@pytest.mark.parametrize('seed', range(3))
def test_it_converges_from_the_papers_initial_spread(drive, model, seed):
    """0.5 m, 0.5 m and 15 degrees; the initial guess is off by a draw from just that."""
    off = np.random.default_rng(seed).standard_normal(3) * [0.5, 0.5, math.pi / 12]
    guess = dict(
        initial_pose_x=START.x_m + off[0], initial_pose_y=START.y_m + off[1], initial_pose_a=START.yaw_rad + off[2]
    )
    estimates = run(amcl(seed, laser_model_type=model, **guess), drive, seed)
    for estimate, (true_pose, _, _) in list(zip(estimates, drive))[-6:]:
        if estimate is None:
            continue
        pose = estimate.base_pose_in_map
        assert math.hypot(pose.x_m - true_pose.x_m, pose.y_m - true_pose.y_m) < 0.08
        assert abs(wrap_angle(pose.yaw_rad - true_pose.yaw_rad)) < math.radians(4)
        assert len(estimate.particles) < 3000  # KLD has found that fewer will do


def test_it_finds_itself_without_a_guess(drive):
    """Global localization, with as many particles as the room is large."""
    filter_ = amcl(1, max_particles=10_000, initial_pose_x=-2.0, initial_pose_y=2.0)
    filter_.global_localization()
    last = [estimate for estimate in run(filter_, drive) if estimate][-1]
    true_pose = drive[-1][0]
    assert np.subtract(last.base_pose_in_map, true_pose)[:2] == pytest.approx(0, abs=0.15)


def test_it_recovers_from_being_carried_off(drive):
    """Kidnapped: scans from elsewhere make the fast average fall and particles go everywhere.

    Whether one of them lands near enough is luck: 6 of the first 24 seeds find the robot within
    100 updates, the others settle where the room, turned by 180 degrees, looks much alike. With
    upstream's average, which depends on the number of particles, none does.
    """
    turns = [moved(Pose2D(-2.0, -0.2, -0.9), 0.0, index * math.pi / 5) for index in range(10)]
    scans = [simulated_scan(pillar_room(), pose) for pose in turns]
    found = 0
    for seed in range(6):
        filter_ = amcl(
            seed, max_particles=10_000, recovery_alpha_slow=0.01, recovery_alpha_fast=0.5, resample_interval=1
        )
        run(filter_, drive[:8], seed)
        odom_pose, rng = drive[7][1], np.random.default_rng(seed)
        for index in range(1, 101):
            odom_pose = moved(odom_pose, 0.0, math.pi / 5)
            estimate = filter_.update(odom_pose, noisy(scans[index % 10], rng), IDENTITY)
        found += np.hypot(*np.subtract(estimate.base_pose_in_map, turns[0])[:2]) < 0.1
    assert found >= 1


def test_fewer_particles_do_not_look_like_a_better_fit(drive):
    """The likelihood that recovery goes by does not depend on the number of particles."""
    scan = drive[0][2]
    likelihoods = []
    for count in (500, 5000):
        filter_ = amcl(max_particles=count, initial_cov_xx=1e-4, initial_cov_yy=1e-4, initial_cov_aa=1e-4)
        filter_.update(IDENTITY, scan, IDENTITY)
        likelihoods.append(filter_._set.averages.fast)
    assert likelihoods[0] == pytest.approx(likelihoods[1], rel=0.01)


def test_map_to_odom_makes_the_estimate_true(drive):
    """And stays what is broadcast until the next estimate."""
    filter_ = amcl()
    assert filter_.odom_pose_in_map is None
    for _, odom_pose, scan in drive[:4]:
        estimate = filter_.update(odom_pose, scan, Pose2D(0.1, 0.0, 0.0))
        if estimate is not None:
            latest = estimate
            assert estimate.odom_pose_in_map.compose(odom_pose) == pytest.approx(estimate.base_pose_in_map)
        assert filter_.odom_pose_in_map == latest.odom_pose_in_map
        assert filter_.last_estimate is latest


def test_a_laser_off_the_middle_gives_the_same_pose(drive):
    """Mounted ahead, aside and turned: the estimate is base_link's all the same."""
    mount, grid = Pose2D(0.2, -0.1, 0.7), pillar_room()
    filter_ = amcl(3)
    for true_pose, odom_pose, _ in drive:
        scan = simulated_scan(grid, true_pose, laser_pose_in_base=mount)
        estimate = filter_.update(odom_pose, scan, mount)
        if estimate is not None:
            error = np.subtract(estimate.base_pose_in_map, true_pose)
    assert error[:2] == pytest.approx(0, abs=0.08)


def test_the_maps_own_frame_does_not_matter(drive):
    """Moved and turned with everything on it, the map gives the same estimate in its frame."""
    shift = Pose2D(10.0, -7.0, 1.1)
    grid = pillar_room()
    there = shift.compose(START)
    moved_filter = amcl(
        4,
        grid._replace(origin=shift.compose(grid.origin)),
        initial_pose_x=there.x_m,
        initial_pose_y=there.y_m,
        initial_pose_a=there.yaw_rad,
        recovery_alpha_slow=0.0,
    )
    last = [estimate for estimate in run(moved_filter, drive) if estimate][-1]
    back = last.base_pose_in_map.relative_to(shift)
    assert np.subtract(back, drive[-1][0])[:2] == pytest.approx(0, abs=0.1)


@pytest.mark.parametrize(
    'changes',
    [
        {},
        dict(laser_model_type='likelihood_field_prob', do_beamskip=True),
        dict(laser_model_type='beam'),
        dict(odom_model_type='diff-corrected'),
    ],
)
def test_equal_seeds_give_equal_bits(drive, changes):
    first, second, other = (run(amcl(seed, **changes), drive[:8]) for seed in (7, 7, 8))
    for a, b in zip(first, second):
        assert (a is None) == (b is None)
        if a is not None:
            assert a.base_pose_in_map == b.base_pose_in_map
            assert a.particles.tobytes() == b.particles.tobytes()
            assert a.covariance.tobytes() == b.covariance.tobytes()
    assert first[-1].base_pose_in_map != other[-1].base_pose_in_map


def test_what_was_handed_out_does_not_change(drive):
    filter_ = amcl(resample_interval=1)
    estimate = filter_.update(drive[0][1], drive[0][2], IDENTITY)
    particles, weights = estimate.particles.copy(), estimate.weights.copy()
    run(filter_, drive[1:4])
    assert (estimate.particles == particles).all() and (estimate.weights == weights).all()


def test_parameters_that_change_leave_particles_and_estimate(drive):
    filter_ = amcl(3)
    run(filter_, drive[:6])
    particles, estimate = filter_.particles, filter_.last_estimate
    filter_.reconfigure(with_changes(filter_.params, {'min_particles': 20, 'max_particles': 50}, ''))
    assert filter_.particles is particles and filter_.last_estimate is estimate
    estimates = [each for each in run(filter_, drive[6:]) if each]
    assert len(estimates[-1].particles) <= 50 < len(particles)
