"""Segments against closed forms, and against evo's choice of pairs on paths of all kinds."""

import math

import numpy as np
import pytest

from diff_encoder_sim.drives.trajectory_error import LENGTH_TOLERANCE, RPE_DISTANCES_M, RpePairs, RunningRelativeErrors


def errors_of(pairs, block=500):
    running = RunningRelativeErrors()
    for first in range(0, len(pairs), block):
        running.add(pairs[first : first + block])
    return running


def line(count, step_m):
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
    return filters.filter_pairs_by_path(matrices(line(30, 0.1)[:, :3]), 1.0)[0][0] == 0


@pytest.mark.heavy
@pytest.mark.parametrize('seed', range(2))
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
    found = errors_of(line(200, 0.05)).results()[RpePairs.ALL]  # 9.95 m
    assert found[10.0].segments == 20  # those from 0 to 0.95 m
    assert found[5.0].segments == 110
    assert errors_of(line(180, 0.05)).results()[RpePairs.ALL][10.0].segments == 0


def test_consecutive_segments_lie_end_to_end():
    found = errors_of(line(161, 0.125)).results()[RpePairs.CONSECUTIVE]  # exact in binary
    assert [found[distance_m].segments for distance_m in RPE_DISTANCES_M] == [20, 4, 2]
