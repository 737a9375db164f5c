"""ATE and RPE against closed forms and evo, and pairs by stamps."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, PoseSeries
from diff_encoder_sim.drives import trajectory_error
from diff_encoder_sim.drives.trajectory_error import LARGEST_GAP_NS, RPE_DISTANCES_M, Alignment, RpePairs, path_error

PERIOD_NS = 50_000_000
MS = 1_000_000


def series(rows):
    return PoseSeries(PERIOD_NS * np.arange(len(rows)), np.array(rows, dtype=float))


def line(length_m, count=401, yaw_rad=0.0):
    along = np.linspace(0.0, length_m, count)
    return np.column_stack((along * math.cos(yaw_rad), along * math.sin(yaw_rad), np.full(count, yaw_rad)))


def in_the_map(estimate, truth):
    return path_error(estimate, truth, Alignment.NONE)


@pytest.mark.parametrize('angle_rad', [0.01, -0.3])
def test_a_wrong_heading_at_the_start_leads_away_in_proportion(angle_rad):
    errors = in_the_map(series(line(20.0, yaw_rad=angle_rad)), series(line(20.0)))
    chord = 2.0 * abs(math.sin(angle_rad / 2.0))
    assert errors.ate_max_m == pytest.approx(20.0 * chord)
    assert errors.ate_rmse_m == pytest.approx(20.0 * chord * math.sqrt(np.mean(np.linspace(0.0, 1.0, 401) ** 2)))
    assert errors.yaw_rmse_rad == pytest.approx(abs(angle_rad))
    # As seen from itself it goes straight.
    assert errors.rpe[RpePairs.CONSECUTIVE][5.0] == pytest.approx((4, 0.0, 0.0), abs=1e-12)


def test_yaw_errors_do_not_jump_at_half_a_turn_and_a_turn_in_place_has_no_segments():
    truth = wrapped(np.column_stack((np.full((200, 2), 3.0), np.linspace(0.0, 10 * math.pi, 200))))
    errors = in_the_map(series(wrapped(truth + (0.0, 0.0, 0.02))), series(truth))
    assert errors.yaw_rmse_rad == pytest.approx(0.02)
    assert all(one.segments == 0 for by_length in errors.rpe.values() for one in by_length.values())


def test_the_order_of_messages_does_not_matter_and_a_repeated_stamp_counts_once():
    rows, truth = line(20.0) + (0.1, 0.0, 0.0), series(line(20.0))
    shuffled = np.concatenate((np.random.default_rng(1).permutation(401), [5, 5]))
    assert in_the_map(PoseSeries(truth.stamps_ns[shuffled], rows[shuffled]), truth) == in_the_map(series(rows), truth)


def test_aligned_origins_are_the_first_poses_laid_on_each_other():
    true = [Pose2D(1.0, 2.0, 0.5).compose(Pose2D(x, 0.0, 0.0)) for x in (0.0, 1.0, 2.0)]
    estimated = [IDENTITY, Pose2D(1.0, 0.03, 0.0), Pose2D(2.04, 0.0, 0.01)]
    error = path_error(series(estimated), series(true), Alignment.ORIGIN)
    assert error.ate_rmse_m == pytest.approx(math.sqrt((0.03**2 + 0.04**2) / 3))
    assert (error.ate_max_m, error.yaw_max_rad, *error.end) == pytest.approx((0.04, 0.01, 0.04, 0.0, 0.01))
    assert in_the_map(series(estimated), series(true)).ate_rmse_m > 2.0


def test_runs_are_aligned_each_by_its_start_and_no_segment_reaches_across():
    pairs = straight_pairs(150, 0.125)
    moved = pairs + (5.0, 0.0, 0.0, 0.0, 3.0, 0.0)
    once, twice = (trajectory_error.pairs_error(each, Alignment.ORIGIN) for each in ([pairs], [pairs, moved]))
    assert (twice.poses, twice.ate_max_m) == (300, pytest.approx(0.0, abs=1e-12))
    assert twice.length_m == pytest.approx(2 * once.length_m)
    for convention in RpePairs:
        for distance_m in RPE_DISTANCES_M:
            assert twice.rpe[convention][distance_m].segments == 2 * once.rpe[convention][distance_m].segments
    assert trajectory_error.pairs_error([pairs[:0]], Alignment.ORIGIN) is None


def path(period_ms, count, first_ms=0):
    """Along x with the time [s], so that a pose shows its stamp."""
    stamps_ns = MS * (first_ms + period_ms * np.arange(count))
    return PoseSeries(stamps_ns, np.column_stack((stamps_ns * 1e-9, np.zeros((count, 2)))))


@pytest.mark.parametrize(
    ('estimate', 'reference', 'expected'),
    [
        (path(100, 11), path(30, 60, -10), range(0, 1001, 100)),
        (path(30, 60, -10), path(100, 11), range(0, 1001, 100)),
        (path(50, 20), path(50, 20, 20), range(50, 1000, 50)),
        (path(50, 20, 20), path(50, 20), range(20, 970, 50)),
        (path(1000, 3, 7), path(LARGEST_GAP_NS // MS, 20), range(7, 2008, 1000)),
        (path(1000, 3, 7), path(LARGEST_GAP_NS // MS + 1, 20), []),
        (path(50, 3, 450), path(50, 3, 700), []),
        (path(50, 0), path(50, 3), []),
    ],
)
def test_the_stamps_of_the_sparser_path_count(estimate, reference, expected):
    pairs = trajectory_error.common_poses(estimate, reference)
    assert pairs[:, 0] == pytest.approx(pairs[:, 3], abs=1e-12)
    assert np.round(1e3 * pairs[:, 0]).astype(int).tolist() == list(expected)


def test_yaw_is_interpolated_by_the_shorter_turn():
    ends = PoseSeries(100 * MS * np.arange(2), np.array([(0.0, 0.0, 3.0), (1.0, 2.0, -3.1)]))
    (pair,) = trajectory_error.common_poses(PoseSeries(np.array([25 * MS]), np.zeros((1, 3))), ends)
    assert pair[3:5] == pytest.approx([0.25, 0.5])
    assert math.remainder(pair[5] - 3.0 - 0.25 * (2.0 * math.pi - 6.1), 2.0 * math.pi) == pytest.approx(0.0, abs=1e-12)


def straight_pairs(count, step_m):
    """(count, 6) of a straight path, the same twice."""
    return np.tile(np.outer(np.arange(count), (step_m, 0.0, 0.0)), 2)


def drive(rng, count):
    """(count, 6): stops, turns in place, drives fast and slowly, and odometry in steps of 2 cm."""
    phases = rng.choice(4, size=count // 20 + 1, p=[0.15, 0.15, 0.2, 0.5]).repeat(20)[:count]
    speeds_m = np.choose(phases, [0.0, 0.0, 1e-7, 0.03]) * rng.uniform(0.5, 1.5, count)
    yaws_rad = np.cumsum(np.choose(phases, [0.0, 0.05, 0.01, 0.01]))
    x_y_m = np.cumsum(np.column_stack((np.cos(yaws_rad), np.sin(yaws_rad))) * speeds_m[:, np.newaxis], axis=0)
    estimated = np.column_stack((0.02 * np.round(x_y_m / 0.02), 0.1 * np.round(yaws_rad / 0.1)))
    return wrapped(np.hstack((estimated, np.column_stack((x_y_m, yaws_rad)))))


def wrapped(poses):
    poses[:, 2::3] = (poses[:, 2::3] + math.pi) % (2.0 * math.pi) - math.pi
    return poses


@pytest.mark.parametrize('convention', RpePairs)
def test_relative_errors_are_those_of_evo(convention):
    metrics, trajectory = (pytest.importorskip(f'evo.core.{name}') for name in ('metrics', 'trajectory'))

    def rpe(pairs, relation, distance_m):
        half_rad, zeros = 0.5 * pairs[:, 2::3], np.zeros(len(pairs))
        paths = [
            trajectory.PosePath3D(
                np.column_stack((pairs[:, at : at + 2], zeros)),
                np.column_stack((np.cos(half_rad[:, at // 3]), zeros, zeros, np.sin(half_rad[:, at // 3]))),
            )
            for at in (3, 0)
        ]
        options = dict(all_pairs=convention is RpePairs.ALL, pairs_from_reference=True)
        found = metrics.RPE(relation, distance_m, metrics.Unit.meters, trajectory_error.LENGTH_TOLERANCE, **options)
        found.process_data(paths)
        return found

    if len(rpe(straight_pairs(30, 0.1), metrics.PoseRelation.translation_part, 1.0).error) == 1:
        pytest.skip('this evo, before 1.32, leaves out the first of the consecutive segments')
    pairs = drive(np.random.default_rng(0), 1500)
    found = trajectory_error.relative_errors([pairs])[convention]
    for distance_m in RPE_DISTANCES_M:
        relations = metrics.PoseRelation.translation_part, metrics.PoseRelation.rotation_angle_rad
        expected = [rpe(pairs, relation, distance_m) for relation in relations]
        errors = [each.get_statistic(metrics.StatisticsType.rmse) for each in expected]
        assert found[distance_m] == pytest.approx((len(expected[0].error), *errors), abs=1e-9)


def test_the_last_segments_may_be_short_by_the_tolerance():
    found = trajectory_error.relative_errors([straight_pairs(200, 0.05)])[RpePairs.ALL]  # 9.95 m
    assert (found[10.0].segments, found[5.0].segments) == (20, 110)  # those from 0 to 0.95 m
    assert trajectory_error.relative_errors([straight_pairs(180, 0.05)])[RpePairs.ALL][10.0].segments == 0
