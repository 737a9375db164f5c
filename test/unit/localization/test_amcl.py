"""The whole filter: that it converges, recovers, repeats itself, and refuses bad input."""

import math

import numpy as np
import pytest

from amcl_world import ELSEWHERE, START, moved, pillar_room, simulated_scan
from diff_encoder_sim.base.errors import InputFault
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.base.yaml_files import load_yaml
from diff_encoder_sim.localization.amcl import Amcl
from diff_encoder_sim.localization.amcl_params import AmclParams
from diff_encoder_sim.localization.laser_models import Likelihoods
from diff_encoder_sim.localization.occupancy_grid import UNKNOWN
from places import CONFIG

STEPS, ROOM = 26, pillar_room()
ROOM_SCAN, NAN_POSE = simulated_scan(ROOM, START), Pose2D(math.nan, 0.0, 0.0)
PAPER = {**load_yaml(CONFIG / 'amcl.yaml'), 'lost_fraction': 0.0}  # its table 2
APART = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [2.0, 2.0, 0.0]])


@pytest.fixture(scope='session')
def drive():
    """Around a circle and on: (true base pose, base in odom, exact scan) of each step."""
    true_pose, odom_pose, steps = START, Pose2D(4.0, -3.0, 0.5), []
    for _ in range(STEPS):
        steps.append((true_pose, odom_pose, simulated_scan(pillar_room(), true_pose)))
        true_pose = moved(true_pose, 0.3, 0.42)
        odom_pose = moved(odom_pose, 0.297, 0.415)
    return steps


def at(pose):
    return dict(zip(('initial_pose_x', 'initial_pose_y', 'initial_pose_a'), pose))


def amcl(seed=0, **changes):
    return Amcl(AmclParams(**{**PAPER, **at(START), **changes}), pillar_room(), np.random.default_rng(seed))


def run(filter_, drive, seed=0):
    rng, estimates = np.random.default_rng([seed, 1]), []
    for _, odom_pose, scan in drive:
        noisy_m = scan.ranges_m + 0.03 * rng.standard_normal(len(scan.ranges_m))
        estimates.append(filter_.update(odom_pose, scan._replace(ranges_m=noisy_m), IDENTITY))
    return estimates


def test_it_finds_itself_without_a_guess(drive):
    filter_ = amcl(1, max_particles=10_000, initial_pose_x=-2.0, initial_pose_y=2.0)
    filter_.global_localization()
    last = [estimate for estimate in run(filter_, drive) if estimate][-1]
    assert np.subtract(last.base_pose_in_map, drive[-1][0])[:2] == pytest.approx(0, abs=0.15)


def test_fewer_particles_do_not_look_like_a_better_fit(drive):
    close = dict.fromkeys(('initial_cov_xx', 'initial_cov_yy', 'initial_cov_aa'), 1e-4)
    few, many = (amcl(max_particles=count, **close) for count in (500, 5000))
    for filter_ in (few, many):
        filter_.update(IDENTITY, drive[0][2], IDENTITY)
    assert few.fast_average == pytest.approx(many.fast_average, rel=0.01)


def test_map_to_odom_makes_the_estimate_true(drive):
    filter_ = amcl()
    assert filter_.odom_pose_in_map is None
    for _, odom_pose, scan in drive[:4]:
        estimate = filter_.update(odom_pose, scan, Pose2D(0.1, 0.0, 0.0))
        if estimate is not None:
            latest = estimate
            assert estimate.odom_pose_in_map.compose(odom_pose) == pytest.approx(estimate.base_pose_in_map)
        assert filter_.odom_pose_in_map == latest.odom_pose_in_map
        assert filter_.last_estimate is latest


@pytest.mark.parametrize(
    'changes', [{}, dict(laser_model_type='likelihood_field_prob', do_beamskip=True), dict(laser_model_type='beam')]
)
def test_equal_seeds_give_equal_bits(drive, changes):
    filters = [amcl(seed, **changes) for seed in (7, 7, 8)]
    first, second, other = (run(filter_, drive[:8]) for filter_ in filters)
    assert filters[0].particles.tobytes() == filters[1].particles.tobytes()
    for a, b in zip(first, second):
        assert (a is None) == (b is None)
        if a is not None:
            assert a.base_pose_in_map == b.base_pose_in_map
            assert a.covariance.tobytes() == b.covariance.tobytes()
    assert first[-1].base_pose_in_map != other[-1].base_pose_in_map


def test_it_updates_only_when_the_robot_has_moved(drive):
    """By update_min_d along x or along y, or update_min_a; each as far as it may go without."""
    scan = drive[0][2]
    filter_ = amcl()
    filter_.update(IDENTITY, scan, IDENTITY)
    before = filter_.particles
    for pose in (Pose2D(0.199, -0.199, 0.0), Pose2D(-0.199, 0.0, math.radians(29.9))):
        assert filter_.update(pose, scan, IDENTITY) is None
        assert filter_.particles is before and filter_.update_count == 1
    for count, pose in enumerate((Pose2D(0.201, 0, 0), Pose2D(0.201, -0.21, 0), Pose2D(0.201, -0.21, -0.53))):
        filter_.update(pose, scan, IDENTITY)
        assert filter_.update_count == count + 2


def test_an_update_can_be_requested_without_motion_and_weights_last_to_the_next_resampling(drive):
    """As in Noetic: two scans on the spot multiply."""
    scan, filter_ = drive[0][2], amcl(resample_interval=2)
    filter_.update(IDENTITY, scan, IDENTITY)
    once = filter_.weights
    filter_.params = filter_.params.model_copy(update={'resample_interval': 100})
    filter_.request_nomotion_update()
    assert filter_.update(IDENTITY, scan, IDENTITY) is None and filter_.update_count == 2
    assert filter_.weights == pytest.approx(once**2 / (once**2).sum())
    filter_.update(IDENTITY, scan, IDENTITY)
    assert filter_.update_count == 2


def test_selective_resampling_keeps_particles_that_still_count(drive):
    selective, plain = amcl(selective_resampling=True, laser_max_beams=2), amcl(laser_max_beams=2)
    for filter_ in (selective, plain):
        assert run(filter_, drive[:2])[1] is not None
    assert len(selective.particles) == 3000 and np.ptp(selective.weights) > 0
    assert np.ptp(plain.weights) == 0


def test_a_new_pose_begins_again(drive):
    filter_ = amcl()
    run(filter_, drive[:5])
    filter_.set_pose(Pose2D(-1.0, 1.5, 3.0), np.diag([0.01, 0.04, 0.0025]))
    assert len(filter_.particles) == 3000
    assert filter_.particles[:, :2].mean(axis=0) == pytest.approx([-1.0, 1.5], abs=0.02)
    assert filter_.particles[:, :2].std(axis=0) == pytest.approx([0.1, 0.2], rel=0.06)
    estimate = filter_.update(drive[5][1], drive[5][2], IDENTITY)
    assert estimate.base_pose_in_map == pytest.approx((-1.0, 1.5, 3.0), abs=0.02)


@pytest.mark.parametrize(
    ('flag', 'restart'),
    [
        ('force_update_after_initialpose', lambda f: f.set_pose(START, np.eye(3) * 0.01)),
        ('force_update_after_set_map', lambda f: f.set_map(pillar_room())),
    ],
)
def test_upstreams_flags_force_a_second_update(drive, flag, restart):
    """The first scan after a restart updates anyway."""
    for value, updates in ((False, 1), (True, 2)):
        filter_ = amcl(**{flag: value})
        restart(filter_)
        for _ in range(4):
            filter_.update(IDENTITY, drive[0][2], IDENTITY)
        assert filter_.update_count == updates


@pytest.mark.parametrize(
    ('changes', 'message'),
    [
        ({'scan': ROOM_SCAN._replace(ranges_m=np.full(180, np.inf))}, 'none of 180 rays'),
        ({'odom_pose': NAN_POSE}, 'odometry pose: given .nan'),
        ({'mount': NAN_POSE}, 'laser pose'),
    ],
)
def test_bad_input_leaves_the_filter_as_it_was(drive, changes, message):
    filter_, untouched = amcl(), amcl()
    for each in (filter_, untouched):
        run(each, drive[:3])
    particles, latest = filter_.particles, filter_.last_estimate
    _, odom_pose, scan = drive[3]
    with pytest.raises(InputFault, match=message):
        filter_.update(*{'odom_pose': odom_pose, 'scan': scan, 'mount': IDENTITY, **changes}.values())
    assert filter_.particles is particles and filter_.last_estimate is latest
    # The next good scan takes up the motion since, and no random number was lost.
    good, expected = (each.update(odom_pose, scan, IDENTITY) for each in (filter_, untouched))
    assert good.base_pose_in_map == expected.base_pose_in_map


@pytest.mark.parametrize(
    'changes', [dict(origin=NAN_POSE), dict(resolution_m=0.0), dict(cells=np.full((5, 5), UNKNOWN, np.int8))]
)
def test_a_bad_map_is_refused_and_the_old_one_stays(changes):
    filter_ = amcl()
    before = filter_.particles
    with pytest.raises(InputFault):
        filter_.set_map(ROOM._replace(**changes))
    assert filter_.particles is before and filter_.grid.cells.shape == (100, 120)


def four(particles=APART, **changes):
    filter_ = amcl(min_particles=4, max_particles=4, **changes)
    filter_._restart(particles)
    return filter_


def test_weights_are_multiplied_by_the_likelihoods_unless_no_particle_explains_the_scan():
    filter_ = four()
    filter_._weigh(Likelihoods(np.array([1.0, 2.0, 3.0, 2.0]), -1000.0))
    filter_._weigh(Likelihoods(np.array([1.0, 1.0, 0.0, 1.0]), 0.0))
    assert filter_.weights == pytest.approx([0.2, 0.4, 0.0, 0.4])
    before = filter_.slow_average
    filter_._weigh(Likelihoods(np.zeros(4), 0.0))
    assert filter_.weights == pytest.approx([0.25] * 4) and filter_.slow_average == before


def test_averages_of_the_likelihood_call_for_recovery():
    filter_ = four(recovery_alpha_slow=0.001, recovery_alpha_fast=0.1)
    assert filter_.fraction_anywhere == 0.0
    for likelihood, slow, fast in ((2.0, 2.0, 2.0), (1.0, 1.999, 1.9), (10.0, 2.007001, 2.71)):
        filter_._weigh(Likelihoods(np.full(4, likelihood), 0.0))
        assert (filter_.slow_average, filter_.fast_average) == pytest.approx((slow, fast))
        assert filter_.fraction_anywhere == pytest.approx(max(0.0, 1.0 - fast / slow))
    filter_._restart(APART)
    filter_._weigh(Likelihoods(np.full(4, 0.5), 0.0))
    assert (filter_.slow_average, filter_.fast_average) == (0.5, 0.5)


def watched(**changes):
    close = dict.fromkeys(('initial_cov_xx', 'initial_cov_yy', 'initial_cov_aa'), 0.0025)
    on = dict(lost_fraction=0.5, lost_scans=5, max_particles=1000, laser_max_beams=60, **close)
    return amcl(**{**on, **changes})


def feed(filter_, true_pose, count, odom_pose=IDENTITY):
    scan = simulated_scan(ROOM, true_pose)
    lost_after_each = []
    for _ in range(count):
        filter_.update(odom_pose, scan, IDENTITY)
        lost_after_each.append(filter_.is_lost)
    return lost_after_each


def test_carried_off_and_back():
    """Lost at the fifth scan; the particles stay, so that it is found when it is back."""
    filter_ = watched()
    assert not any(feed(filter_, START, 5)) and filter_.fit_fraction == 1.0
    particles = filter_.particles
    assert feed(filter_, ELSEWHERE, 20) == [False] * 4 + [True] * 16
    assert filter_.particles is particles
    assert feed(filter_, START, 6) == [True] * 4 + [False] * 2


def test_global_localization_is_not_settled_on_the_spot():
    """Standing still, the particles would agree on a place that only looks alike."""
    filter_ = watched()
    feed(filter_, START, 3)
    filter_.global_localization()
    assert filter_.is_lost
    count = filter_.update_count
    assert all(feed(filter_, START, 20)) and filter_.update_count == count + 1


def test_upstreams_default_is_never_lost():
    filter_ = watched(lost_fraction=0.0)
    feed(filter_, START, 1)
    assert not any(feed(filter_, ELSEWHERE, 20)) and filter_.fit_fraction is None
    filter_.global_localization()
    assert not filter_.is_lost
