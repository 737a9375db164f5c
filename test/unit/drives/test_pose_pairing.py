"""Which stamps are compared where paths come at other times, and what is interpolated."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import PoseSeries
from diff_encoder_sim.drives.trajectory_error import LARGEST_GAP_NS, WaitingPoses, take_pairs

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


def test_equal_stamps_are_a_pair_however_far_apart():
    sparse = path(5000, 4)
    assert stamps_ms(take_pairs(sparse, path(5000, 4))) == [0, 5000, 10_000, 15_000]
    assert len(take_pairs(path(5000, 4), path(5000, 4, 1))) == 0


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
