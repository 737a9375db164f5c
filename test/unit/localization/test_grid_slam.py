"""The mapper as a whole: in a small room, in the shipped worlds, and over recorded drives."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.errors import ConfigError, InputFault
from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.localization import grid_slam as room
from diff_encoder_sim.localization.grid_slam import GridSlam, OdometryTrack, entropy_of, map_recording
from slam_drives import HALLWAY, ROS_LOGO, Case
from slam_room import around_the_room, params, patch_counts, room_scan

START = Pose2D(0.4, -0.3, 0.5)  # in odom, of the first scan
SECOND_NS = 10**9


def drive(seed=1, noise=0.0, sigma_m=0.01, count=40, **changes):
    rng = np.random.default_rng(99)
    slam, true = GridSlam(params(**changes), np.random.default_rng(seed)), around_the_room()[:count]
    drift = noise * np.cumsum(rng.standard_normal((len(true), 3)), axis=0) * [1.0, 1.0, 0.5]
    odometry, estimates = [], []
    for index, pose in enumerate(true):
        off = drift[index] - drift[0]
        odometry.append(START.compose(Pose2D(*(np.array(pose.relative_to(true[0])) + off).tolist())))
        scan = room_scan(pose, rng, sigma_m, stamp_ns=index * SECOND_NS)
        estimates.append(slam.update(odometry[-1], scan, IDENTITY))
    return slam, odometry, estimates


def test_equal_seeds_give_equal_bytes_and_others_do_not():
    def result(seed):
        slam, _, estimates = drive(seed, noise=0.02, count=20)
        return (slam.map().cells.tobytes(), slam.particles.tobytes(), str(estimates))

    first = result(3)
    assert first == result(3)
    assert first[1] != result(4)[1]


def test_particles_are_redrawn_when_few_of_them_count():
    *_, estimates = drive(noise=0.03, sigma_m=0.03)
    estimates = [estimate for estimate in estimates if estimate]
    assert all(estimate.has_resampled == (estimate.effective_count < 4.0) for estimate in estimates[1:])
    assert 2 <= sum(estimate.has_resampled for estimate in estimates) < len(estimates) - 2
    assert all(0.0 <= estimate.entropy <= math.log(8) for estimate in estimates[2:])
    assert estimates[0].base_pose_in_map == pytest.approx(START)
    never, _, its = drive(noise=0.03, sigma_m=0.03, resampleThreshold=0.0)
    assert not any(estimate.has_resampled for estimate in its if estimate)
    assert 1.0 / np.square(room.normalised(never._log_weights)).sum() < 4.0


def test_scans_are_entered_after_a_move_a_turn_or_a_time():
    slam = GridSlam(params(temporalUpdate=5.0), np.random.default_rng(0))

    def enters(x_m, yaw_rad, stamp_s):
        pose = Pose2D(x_m, 0.0, yaw_rad)
        scan = room_scan(pose, stamp_ns=round(stamp_s * SECOND_NS))
        return slam.update(pose, scan, IDENTITY) is not None

    assert enters(0.0, 0.0, 0.0)
    assert not enters(0.19, 0.0, 1.0)
    assert enters(0.21, 0.0, 1.1)
    assert not enters(0.21, -0.19, 1.2)
    # A pulse to and fro is no turn, however often.
    assert not any(enters(0.21, 0.15 * (-1) ** step, 1.3 + 0.1 * step) for step in range(6))
    assert enters(0.21, -0.21, 2.0)
    assert not enters(0.21, -0.21, 7.0)
    assert enters(0.21, -0.21, 7.1)


@pytest.mark.parametrize(
    'change', [dict(ranges_m=np.empty(0)), dict(angle_increment_rad=math.nan), dict(range_max_m=0.0), dict(stamp_ns=0)]
)
def test_bad_scans_change_nothing(change):
    slam, odometry, _ = drive(count=5)
    before = slam.map().cells.tobytes(), slam.last_estimate, slam.particles.tobytes()
    scan = room_scan(IDENTITY, stamp_ns=100 * SECOND_NS)._replace(**change)
    with pytest.raises(InputFault):
        slam.update(odometry[-1].compose(Pose2D(0.3, 0.0, 0.0)), scan, IDENTITY)
    assert (slam.map().cells.tobytes(), slam.last_estimate, slam.particles.tobytes()) == before


@pytest.fixture(scope='session', params=[HALLWAY, ROS_LOGO], ids=lambda tour: tour.world)
def case(request):
    return Case(request.param)


@pytest.mark.parametrize(
    ('odometry', 'noise', 'correct', 'ate_m'), [('ideal', 'fine', 0.99, 0.015), ('40', 'coarse', 0.98, 0.05)]
)
def test_the_map_of_a_drive(case, odometry, noise, correct, ate_m):
    """With 40 PPR and 3 cm of noise, odometry alone ends decimetres off."""
    accuracy, error, slam, bias_m = case.map(odometry, noise, particles=6)
    assert accuracy.correct_fraction >= correct and accuracy.mapped_fraction >= 0.97
    assert error.ate_rmse_m < ate_m
    if odometry == 'ideal':
        assert np.abs(bias_m).max() < 0.003
    else:
        # Of the ROS-logo world each scan sees most patches, so there its particles have little in common.
        shared, unshared = patch_counts(slam.maps)
        assert shared < {'hallway': 0.85, 'ros_logo': 0.95}[case.world.name] * unshared


def recording():
    scans = [room_scan(pose, stamp_ns=(10 * index + 5) * 10**8) for index, pose in enumerate(around_the_room())]
    stamps_ns = [index * SECOND_NS for index in range(len(scans) + 1)]
    return stamps_ns, [*around_the_room(), around_the_room()[-1]], scans


def test_a_recording_is_mapped(caplog):
    stamps_ns, poses, scans = recording()
    slam = GridSlam(params(throttle_scans=2), np.random.default_rng(0))
    entered = map_recording(slam, OdometryTrack(stamps_ns, poses), scans, IDENTITY)
    assert entered == 20 and not caplog.records
    halfway = OdometryTrack(stamps_ns, poses).at(scans[0].stamp_ns)
    assert halfway == pytest.approx(np.mean([poses[0], poses[1]], axis=0), abs=1e-9)


def test_a_recording_that_goes_back_in_time_keeps_the_first_drive(caplog):
    stamps_ns, poses, scans = recording()
    slam = GridSlam(params(angularUpdate=0.1), np.random.default_rng(0))
    track = OdometryTrack(stamps_ns + stamps_ns[:5], poses + poses[:5])
    assert map_recording(slam, track, scans + scans[:5], IDENTITY) == len(scans)
    assert 'odometry stamps go back' in caplog.text and 'the map so far is kept' in caplog.text


@pytest.mark.parametrize(('odometry', 'scans', 'later_ns'), [(0, 40, 0), (41, 0, 0), (41, 40, 1000 * SECOND_NS)])
def test_half_a_recording_is_refused(odometry, scans, later_ns):
    stamps_ns, poses, all_scans = recording()
    track = OdometryTrack([stamp_ns + later_ns for stamp_ns in stamps_ns[:odometry]], poses[:odometry])
    with pytest.raises(ConfigError):
        map_recording(GridSlam(params(), np.random.default_rng(0)), track, all_scans[:scans], IDENTITY)


def test_sigmas_of_a_move():
    given = params(srr=0.1, srt=0.2, str=0.3, stt=0.4)
    assert room.move_sigmas(Pose2D(1.0, 0.0, 0.0), given) == pytest.approx([0.1, 0.03, 0.2])
    assert room.move_sigmas(Pose2D(-1.0, 0.0, -0.5), given) == pytest.approx([0.25, 0.18, 0.4])
    assert (room.move_sigmas(IDENTITY, given) > 0.0).all()


def test_systematic_resampling_keeps_proportions():
    weights = np.array([0.05, 0.5, 0.0, 0.25, 0.2])
    drawn = np.array([room.systematic_indices(weights, np.random.default_rng(seed)) for seed in range(2000)])
    counts = (drawn[..., np.newaxis] == np.arange(5)).sum(axis=1)
    assert (np.diff(drawn) >= 0).all() and (np.abs(counts - 5 * weights) < 1.0).all()
    assert counts.mean(axis=0) / 5 == pytest.approx(weights, abs=0.005)


def test_weights_from_logs_and_their_entropy():
    assert room.normalised(np.array([-1e6, -1e6])) == pytest.approx([0.5, 0.5])
    assert entropy_of(np.full(30, 1 / 30)) == pytest.approx(math.log(30)) and entropy_of(np.array([1.0, 0.0])) == 0.0
