"""ATE and RPE against closed forms and evo: of whole paths, of streams, and of pairs by stamps."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, PoseSeries
from diff_encoder_sim.drives.trajectory_error import (
    LARGEST_GAP_NS,
    LENGTH_TOLERANCE,
    RPE_DISTANCES_M,
    Alignment,
    PathComparison,
    RpePairs,
    RunningPathError,
    RunningRelativeErrors,
    WaitingPoses,
    path_error,
    rpe_name,
    take_pairs,
)
from reencoding_drives import angles_rad, true_poses

PERIOD_NS = 50_000_000


def series(rows, first_ns=0, period_ns=PERIOD_NS):
    rows = np.array(rows, dtype=float)
    return PoseSeries(first_ns + period_ns * np.arange(len(rows)), rows)


def line(length_m, count=401, yaw_rad=0.0):
    along = np.linspace(0.0, length_m, count)
    return np.column_stack((along * math.cos(yaw_rad), along * math.sin(yaw_rad), np.full(count, yaw_rad)))


def in_the_map(estimate, truth):
    return path_error(estimate, truth, Alignment.NONE)


def consecutive(estimated, true):
    """RPE by length of the segments, (n, 3) each."""
    running = RunningRelativeErrors()
    running.add(np.hstack((estimated, true)))
    return running.results()[RpePairs.CONSECUTIVE]


def test_a_constant_offset_is_not_aligned_away_but_has_no_relative_error():
    errors = in_the_map(series(line(20.0) + (0.3, -0.4, 0.0)), series(line(20.0)))
    assert (errors.ate_rmse_m, errors.ate_max_m) == (pytest.approx(0.5), pytest.approx(0.5))
    assert errors.rpe[RpePairs.CONSECUTIVE][10.0].translation_rmse_m == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize('angle_rad', [0.01, -0.3])
def test_a_wrong_heading_at_the_start_leads_away_in_proportion(angle_rad):
    errors = in_the_map(series(line(20.0, yaw_rad=angle_rad)), series(line(20.0)))
    chord = 2.0 * abs(math.sin(angle_rad / 2.0))
    assert errors.ate_max_m == pytest.approx(20.0 * chord)
    fraction = np.linspace(0.0, 1.0, 401)
    assert errors.ate_rmse_m == pytest.approx(20.0 * chord * math.sqrt(np.mean(fraction**2)))
    assert errors.yaw_rmse_rad == pytest.approx(abs(angle_rad))
    assert errors.rpe[RpePairs.CONSECUTIVE][5.0] == pytest.approx(
        (4, 0.0, 0.0), abs=1e-12
    )  # as seen from itself it goes straight


def test_a_scale_error_is_the_same_over_each_stretch():
    scale = np.array([1.02, 1.02, 1.0])
    errors = in_the_map(series(line(20.0) * scale), series(line(20.0)))
    for distance_m in (1.0, 5.0, 10.0):
        assert errors.rpe[RpePairs.CONSECUTIVE][distance_m].translation_rmse_m == pytest.approx(
            0.02 * distance_m, rel=1e-6
        )
    assert errors.ate_max_m == pytest.approx(0.4)


def test_yaw_errors_do_not_jump_at_half_a_turn_and_a_turn_in_place_has_no_stretches():
    yaws_rad = np.linspace(0.0, 10 * math.pi, 200)
    truth = np.column_stack((np.full((200, 2), 3.0), (yaws_rad + math.pi) % (2 * math.pi) - math.pi))
    estimate = truth + (0.0, 0.0, 0.02)
    estimate[:, 2] = (estimate[:, 2] + math.pi) % (2 * math.pi) - math.pi
    errors = in_the_map(series(estimate), series(truth))
    assert errors.yaw_rmse_rad == pytest.approx(0.02)
    assert all(one.segments == 0 for by_length in errors.rpe.values() for one in by_length.values())


def test_drift_on_a_circle_is_the_turn_over_each_stretch():
    radius_m, drift_rad_per_m = 2.0, 0.003
    along_m = np.linspace(0.0, 30.0, 30_001)

    def circle(curvature):
        yaw_rad = along_m * curvature
        return np.column_stack((np.sin(yaw_rad) / curvature, (1.0 - np.cos(yaw_rad)) / curvature, yaw_rad))

    errors = consecutive(circle(1.0 / radius_m + drift_rad_per_m), circle(1.0 / radius_m))
    for distance_m in (1.0, 5.0, 10.0):
        assert errors[distance_m].rotation_rmse_rad == pytest.approx(drift_rad_per_m * distance_m, rel=1e-2)


def test_nothing_is_guessed_before_after_or_across_a_gap():
    truth = PoseSeries(np.array([10, 11, 20]) * PERIOD_NS, np.zeros((3, 3)))
    estimate = PoseSeries(np.array([9, 10, 11, 15, 20, 21]) * PERIOD_NS, np.zeros((6, 3)))
    assert in_the_map(estimate, truth).poses == 3
    assert in_the_map(PoseSeries(estimate.stamps_ns[:1], estimate.x_y_yaw[:1]), truth) is None


def test_the_order_of_messages_does_not_matter_and_a_repeated_stamp_counts_once():
    rows, truth = line(20.0) + (0.1, 0.0, 0.0), series(line(20.0))
    shuffled = np.concatenate((np.random.default_rng(1).permutation(401), [5, 5]))
    estimate = PoseSeries(truth.stamps_ns[shuffled], rows[shuffled])
    assert in_the_map(estimate, truth) == in_the_map(series(rows), truth)
    assert estimate.path_length_m() == pytest.approx(20.0)


def test_aligned_origins_are_the_first_poses_laid_on_each_other():
    true = [Pose2D(1.0, 2.0, 0.5).compose(Pose2D(x, 0.0, 0.0)) for x in (0.0, 1.0, 2.0)]
    estimated = [Pose2D(0.0, 0.0, 0.0), Pose2D(1.0, 0.03, 0.0), Pose2D(2.04, 0.0, 0.01)]
    error = path_error(series(estimated), series(true), Alignment.ORIGIN)
    assert error.ate_rmse_m == pytest.approx(math.sqrt((0.03**2 + 0.04**2) / 3))
    assert (error.ate_max_m, error.yaw_max_rad) == pytest.approx((0.04, 0.01))
    assert path_error(series(true), series(true), Alignment.ORIGIN).ate_rmse_m == pytest.approx(0.0, abs=1e-12)
    assert in_the_map(series(estimated), series(true)).ate_rmse_m > 2.0


MS = 1_000_000


def path(period_ms, count, first_ms=0):
    """Along x with the time [s], so that a pose tells its stamp."""
    stamps_ns = MS * (first_ms + period_ms * np.arange(count))
    waiting = WaitingPoses()
    waiting.extend(PoseSeries(stamps_ns, np.column_stack((stamps_ns * 1e-9, np.zeros((count, 2))))))
    return waiting


def stamps_ms(pairs):
    assert pairs[:, 0] == pytest.approx(pairs[:, 3], abs=1e-12)
    return np.round(1e3 * pairs[:, 0]).astype(int).tolist()


@pytest.mark.parametrize(
    ('estimate', 'reference'),
    [(path(100, 11), path(30, 60, -10)), (path(30, 60, -10), path(100, 11))],
    ids=['estimate', 'reference'],
)
def test_the_stamps_of_the_sparser_count(estimate, reference):
    assert stamps_ms(take_pairs(estimate, reference)) == list(range(0, 1001, 100))


@pytest.mark.parametrize(('first', 'second'), [(0, 20), (20, 0)])
def test_of_two_equally_dense_paths_it_is_the_estimates(first, second):
    found = stamps_ms(take_pairs(path(50, 20, first), path(50, 20, second)))
    assert all(stamp_ms % 50 == first for stamp_ms in found)
    assert len(found) == 19


def test_the_largest_gap():
    gap_ms = LARGEST_GAP_NS // MS
    assert stamps_ms(take_pairs(path(1000, 3, 7), path(gap_ms, 20))) == [7, 1007, 2007]
    assert len(take_pairs(path(1000, 3, 7), path(gap_ms + 1, 20))) == 0


def test_parts_make_the_same_pairs_as_the_whole():
    rng = np.random.default_rng(3)
    stamps = [np.unique(rng.integers(0, 4000, count)) for count in (60, 200)]
    whole = [WaitingPoses(), WaitingPoses()]
    parts = [WaitingPoses(), WaitingPoses()]
    for one, at in zip(whole, stamps):
        one.extend(PoseSeries(at * MS, np.column_stack((at * 1e-3, np.zeros((len(at), 2))))))
    found = []
    for first in range(0, 4000, 170):
        for one, at in zip(parts, stamps):
            now = at[(first <= at) & (at < first + 170)]
            one.extend(PoseSeries(now * MS, np.column_stack((now * 1e-3, np.zeros((len(now), 2))))))
        found.append(take_pairs(*parts))
    assert stamps_ms(np.concatenate(found)) == stamps_ms(take_pairs(*whole))


def test_the_shorter_turn():
    dense, sparse = WaitingPoses(), WaitingPoses()
    dense.extend(PoseSeries(np.array([0, 50]) * MS, np.array([(0.0, 0.0, 3.1), (1.0, 2.0, -3.1)])))
    sparse.extend(PoseSeries(np.array([25]) * MS, np.zeros((1, 3))))
    [pair] = take_pairs(sparse, dense)
    assert pair[3:5] == pytest.approx((0.5, 1.0))
    assert abs(pair[5]) == pytest.approx(math.pi)


def test_as_evo_interpolates():
    sync = pytest.importorskip('evo.core.sync', reason='evo is not installed: requirements-test.txt')
    if not hasattr(sync, 'SyncMethod'):
        pytest.skip('this evo does not interpolate')
    trajectory = pytest.importorskip('evo.core.trajectory')
    rng = np.random.default_rng(5)
    series = []
    for period_ms in (100, 30):
        stamps_ns = MS * (period_ms * np.arange(3000 // period_ms) + 1)
        series.append(PoseSeries(stamps_ns, rng.normal(size=(len(stamps_ns), 3))))
    expected = sync.associate_trajectories(
        *(
            trajectory.PoseTrajectory3D(
                positions_xyz=np.column_stack((one.x_y_yaw[:, :2], np.zeros(len(one.stamps_ns)))),
                orientations_quat_wxyz=[(math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)) for yaw in one.x_y_yaw[:, 2]],
                timestamps=one.stamps_ns * 1e-9,
            )
            for one in reversed(series)
        ),
        sync_method=sync.SyncMethod.interpolation,
        max_diff=0.1,
    )
    waiting = WaitingPoses(), WaitingPoses()
    for one, poses in zip(waiting, series):
        one.extend(poses)
    found = take_pairs(*waiting)
    reference, estimate = expected
    assert found[:, :2] == pytest.approx(estimate.positions_xyz[:, :2])
    assert found[:, 3:5] == pytest.approx(reference.positions_xyz[:, :2])
    yaws_rad = reference.get_orientations_euler()[:, 2]
    assert np.abs(np.sin(0.5 * (found[:, 5] - yaws_rad))).max() < 1e-9


PLACE = Pose2D(3.0, -2.0, 2.5)  # of the reference's frame


def paths(count=2000):
    """A bend of some 40 m, and an estimate of it that wanders off."""
    truth = true_poses(angles_rad(count, speeds_radps=(18.0, 22.0)))
    rng, walk = np.random.default_rng(4), np.zeros(3)
    estimate = []
    for pose in truth:
        walk = walk + rng.normal(scale=(1e-3, 1e-3, 2e-4))
        estimate.append(pose.compose(Pose2D(*walk.tolist())))
    return estimate, [PLACE.compose(pose) for pose in truth]


def series_of(poses, first_ns=0):
    return PoseSeries(first_ns + PERIOD_NS * np.arange(len(poses)), np.array(poses))


def numbers(error):
    """All of them, in one row."""
    relative = [number for by_length in error.rpe.values() for one in by_length.values() for number in one]
    return [*error[:5], *error.end, error.length_m, *relative]


@pytest.mark.parametrize('alignment', Alignment)
def test_the_same_comes_of_streams_and_of_the_whole(alignment):
    estimate, reference = paths()
    streamed = PathComparison(alignment)
    for index, (one, other) in enumerate(zip(estimate, reference)):
        streamed.take_estimate(index * PERIOD_NS, one)
        streamed.take_reference(index * PERIOD_NS, other)
    whole = path_error(series_of(estimate), series_of(reference), alignment)
    assert numbers(streamed.result()) == pytest.approx(numbers(whole), rel=1e-12)
    assert numbers(streamed.result()) == numbers(streamed.result())


def test_without_a_pair_there_is_no_error():
    assert RunningPathError(Alignment.NONE).result() is None
    assert PathComparison(Alignment.NONE).result() is None


def straight(stamp_ns):
    return Pose2D(stamp_ns * 1e-9, 0.0, 0.1)


@pytest.mark.parametrize('lag', [-40, -1, 0, 1, 40], ids='reference lags by {}'.format)
def test_references_between_stamps_are_met_by_interpolation(lag):
    comparison, count = PathComparison(Alignment.ORIGIN), 100
    for index in range(-50, count + 50):
        if 0 <= index < count:
            comparison.take_estimate(index * PERIOD_NS, straight(index * PERIOD_NS))
        late = index - lag
        if 0 <= late < count:
            stamp_ns = late * PERIOD_NS + PERIOD_NS // 3
            comparison.take_reference(stamp_ns, straight(stamp_ns))
    found = comparison.result()
    assert found.poses == count - 1  # the first is before the reference
    assert found.ate_max_m < 1e-12


@pytest.mark.parametrize('count', [40, 1600])
def test_time_that_jumps_back_begins_again_from_a_common_start(count):
    comparison = PathComparison(Alignment.ORIGIN)
    for offset in (IDENTITY, PLACE):
        for index in range(count):
            stamp_ns = index * PERIOD_NS
            comparison.take_reference(stamp_ns, straight(stamp_ns))
            comparison.take_estimate(stamp_ns, offset.compose(straight(stamp_ns)))
    found = comparison.result()
    assert found.poses >= 2 * count - 1
    assert found.ate_max_m < 1e-12
    for by_length in found.rpe.values():
        assert all(not one.segments or one.translation_rmse_m < 1e-12 for one in by_length.values())


def errors_of(pairs, block=500):
    running = RunningRelativeErrors()
    for first in range(0, len(pairs), block):
        running.add(pairs[first : first + block])
    return running


def straight_pairs(count, step_m):
    """(count, 6) of a straight path, the same twice."""
    poses = np.zeros((count, 3))
    poses[:, 0] = step_m * np.arange(count)
    return np.hstack((poses, poses))


def drive(rng, count):
    """(count, 6): stops, turns in place, drives fast and slowly, and odometry in steps of 2 cm."""
    phases = rng.choice(4, size=count // 20 + 1, p=[0.15, 0.15, 0.2, 0.5]).repeat(20)[:count]
    speeds_m = np.choose(phases, [0.0, 0.0, 1e-7, 0.03]) * rng.uniform(0.5, 1.5, count)
    yaws_rad = np.cumsum(np.choose(phases, [0.0, 0.05, 0.01, 0.01]))
    x_y_m = np.cumsum(np.column_stack((np.cos(yaws_rad), np.sin(yaws_rad))) * speeds_m[:, np.newaxis], axis=0)
    estimated = np.column_stack((0.02 * np.round(x_y_m / 0.02), 0.1 * np.round(yaws_rad / 0.1)))
    true = np.column_stack((x_y_m, yaws_rad))
    return wrapped(np.hstack((estimated, true)))


def wrapped(pairs):
    pairs[:, 2::3] = (pairs[:, 2::3] + math.pi) % (2.0 * math.pi) - math.pi
    return pairs


def matrices(poses):
    """Return poses as evo has them: 4 x 4 each."""
    found = np.tile(np.eye(4), (len(poses), 1, 1))
    found[:, 0, 0] = found[:, 1, 1] = np.cos(poses[:, 2])
    found[:, 1, 0] = np.sin(poses[:, 2])
    found[:, 0, 1] = -found[:, 1, 0]
    found[:, :2, 3] = poses[:, :2]
    return found


def evo_error(pairs, distance_m, convention):
    """Segments, translation [m] and rotation [rad] as evo has them."""
    metrics = pytest.importorskip('evo.core.metrics', reason='evo is not installed: requirements-test.txt')
    trajectory = pytest.importorskip('evo.core.trajectory')
    paths = tuple(trajectory.PosePath3D(poses_se3=list(matrices(part))) for part in (pairs[:, 3:], pairs[:, :3]))
    found = []
    for relation in (metrics.PoseRelation.translation_part, metrics.PoseRelation.rotation_angle_rad):
        rpe = metrics.RPE(
            relation,
            distance_m,
            metrics.Unit.meters,
            LENGTH_TOLERANCE,
            all_pairs=convention is RpePairs.ALL,
            pairs_from_reference=True,
        )
        rpe.process_data(paths)
        found.append(rpe.get_statistic(metrics.StatisticsType.rmse))
    return len(rpe.error), *found


def begins_at_the_first_pose():
    """Whether this evo's first consecutive segment does: those before 1.32 leave it out."""
    filters = pytest.importorskip('evo.core.filters', reason='evo is not installed: requirements-test.txt')
    return filters.filter_pairs_by_path(matrices(straight_pairs(30, 0.1)[:, :3]), 1.0)[0][0] == 0


@pytest.mark.heavy
@pytest.mark.parametrize('seed', [0])
@pytest.mark.parametrize('convention', RpePairs)
def test_as_evo(seed, convention):
    if convention is RpePairs.CONSECUTIVE and not begins_at_the_first_pose():
        pytest.skip('this evo leaves out the first of the consecutive segments')
    pairs = drive(np.random.default_rng(seed), 1500)
    for block in (1500, 61):
        found = errors_of(pairs, block).results()[convention]
        for distance_m in RPE_DISTANCES_M:
            assert found[distance_m] == pytest.approx(evo_error(pairs, distance_m, convention), abs=1e-9)


def test_the_last_segments_may_be_short_by_the_tolerance():
    found = errors_of(straight_pairs(200, 0.05)).results()[RpePairs.ALL]  # 9.95 m
    assert found[10.0].segments == 20  # those from 0 to 0.95 m
    assert found[5.0].segments == 110
    assert errors_of(straight_pairs(180, 0.05)).results()[RpePairs.ALL][10.0].segments == 0


def test_consecutive_segments_lie_end_to_end():
    found = errors_of(straight_pairs(161, 0.125)).results()[RpePairs.CONSECUTIVE]  # exact in binary
    assert [found[distance_m].segments for distance_m in RPE_DISTANCES_M] == [20, 4, 2]


def test_names_of_columns():
    assert rpe_name(RpePairs.CONSECUTIVE, 10.0) == 'rpe_10m'
    assert rpe_name(RpePairs.ALL, 2.5) == 'rpe_2.5m_all_pairs'
    assert [pairs.text for pairs in RpePairs] == ['consecutive', 'all pairs']


def test_a_jump_is_in_one_of_the_consecutive_segments_and_in_each_of_all_pairs_that_hold_it():
    pairs = straight_pairs(81, 0.25)
    pairs[41:, 1] = 0.4  # of the estimate, within the third of the segments of 5 m
    found = errors_of(pairs).results()
    for convention, jumps in ((RpePairs.CONSECUTIVE, 1), (RpePairs.ALL, 20)):
        error = found[convention][5.0]
        assert error.translation_rmse_m == pytest.approx(0.4 * np.sqrt(jumps / error.segments))
        assert error.rotation_rmse_rad == 0.0


def test_a_restart_ends_all_segments():
    running, one = errors_of(straight_pairs(150, 0.125)), errors_of(straight_pairs(150, 0.125)).results()
    running.restart()
    running.add(straight_pairs(150, 0.125))
    twice = running.results()
    for pairs in RpePairs:
        for distance_m in RPE_DISTANCES_M:
            assert twice[pairs][distance_m].segments == 2 * one[pairs][distance_m].segments
    assert running.length_m == pytest.approx(2 * 149 * 0.125)
