"""Errors of a path as it comes, against the same of the whole path in arrays."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, PoseSeries
from diff_encoder_sim.drives.trajectory_error import (
    LARGEST_BACKLOG,
    LARGEST_GAP_NS,
    LENGTH_TOLERANCE,
    RPE_DISTANCES_M,
    Alignment,
    PathComparison,
    RpePairs,
    RunningPathError,
    path_error,
)
from reencoding_drives import angles_rad, true_poses

PERIOD_NS = 50_000_000
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


def series(poses, first_ns=0):
    return PoseSeries(first_ns + PERIOD_NS * np.arange(len(poses)), np.array(poses))


def matrix(pose):
    cos, sin = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    return np.array([[cos, -sin, pose.x_m], [sin, cos, pose.y_m], [0.0, 0.0, 1.0]])


@pytest.mark.heavy
@pytest.mark.parametrize('block', [1, 7, 500, 5000], ids='blocks of {}'.format)
def test_against_matrices(block):
    estimate, reference = paths()
    running, pairs = RunningPathError(Alignment.ORIGIN), np.hstack((estimate, reference))
    for first in range(0, len(pairs), block):
        running.add(pairs[first : first + block])
    found = running.result()
    estimates, references = (
        [np.linalg.inv(matrix(path[0])) @ matrix(pose) for pose in path] for path in (estimate, reference)
    )
    offsets = np.array([(one - other)[:2, 2] for one, other in zip(estimates, references)])
    assert found.ate_rmse_m == pytest.approx(math.sqrt((offsets**2).sum(axis=1).mean()))
    assert found.ate_max_m == pytest.approx(np.hypot(*offsets.T).max())
    assert found.end[:2] == pytest.approx(offsets[-1])
    lengths = np.concatenate(
        ([0.0], np.cumsum([np.hypot(*(two - one)[:2, 2]) for one, two in zip(references, references[1:])]))
    )
    assert found.length_m == pytest.approx(lengths[-1])
    assert found.poses == len(estimate)
    for distance_m in RPE_DISTANCES_M:
        check_all_pairs(found.rpe[RpePairs.ALL][distance_m], distance_m, estimates, references, lengths)


def check_all_pairs(found, distance_m, estimates, references, lengths):
    squares, yaws = [], []
    for start in range(len(lengths) - 1):
        misses = np.abs(lengths[start + 1 :] - lengths[start] - distance_m)
        if misses.min() <= LENGTH_TOLERANCE * distance_m:
            end = start + 1 + misses.argmin()
            true_step, step = (np.linalg.inv(path[start]) @ path[end] for path in (references, estimates))
            error = np.linalg.inv(true_step) @ step
            squares.append((error[:2, 2] ** 2).sum())
            yaws.append(math.atan2(error[1, 0], error[0, 0]) ** 2)
    assert found.segments == len(squares) > 100
    assert found.translation_rmse_m == pytest.approx(math.sqrt(np.mean(squares)))
    assert found.rotation_rmse_rad == pytest.approx(math.sqrt(np.mean(yaws)))


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
    whole = path_error(series(estimate), series(reference), alignment)
    assert numbers(streamed.result()) == pytest.approx(numbers(whole), rel=1e-12)
    assert numbers(streamed.result()) == numbers(streamed.result())


def test_a_path_is_compared_with_itself_wherever_it_lies():
    _, reference = paths()
    running = RunningPathError(Alignment.ORIGIN)
    running.add(np.hstack(([PLACE.inverse().compose(pose) for pose in reference], reference)))
    found = running.result()
    assert found.ate_max_m < 1e-12
    assert found.yaw_max_rad < 1e-12
    for by_length in found.rpe.values():
        assert all(relative.translation_rmse_m < 1e-12 for relative in by_length.values())


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


def test_equal_stamps_are_not_interpolated():
    comparison = PathComparison(Alignment.ORIGIN)
    for index, odd in enumerate([0.0, 1.0, 0.0, 1.0]):
        comparison.take_reference(index * PERIOD_NS, Pose2D(odd, 0.0, 0.0))
        comparison.take_estimate(index * PERIOD_NS, Pose2D(odd, 0.0, 0.0))
    assert comparison.result().ate_max_m == 0.0


def test_no_error_is_made_up_in_a_gap():
    comparison = PathComparison(Alignment.ORIGIN)
    for stamp_ns in (0, LARGEST_GAP_NS + 1):
        comparison.take_estimate(stamp_ns, IDENTITY)
    comparison.take_reference(0, IDENTITY)
    comparison.take_reference(LARGEST_GAP_NS // 2, straight(0))
    assert comparison.result().poses == 1


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


def test_a_repeated_stamp_counts_once():
    comparison = PathComparison(Alignment.NONE)
    for stamp_ns in (0, 0, PERIOD_NS, PERIOD_NS):
        comparison.take_reference(stamp_ns, IDENTITY)
        comparison.take_estimate(stamp_ns, IDENTITY)
    assert comparison.result().poses == 2


@pytest.mark.parametrize('take', ['take_reference', 'take_estimate'])
def test_what_waits_for_the_other_path_does_not_grow(take):
    comparison = PathComparison(Alignment.ORIGIN)
    for index in range(3 * LARGEST_BACKLOG):
        getattr(comparison, take)(index * PERIOD_NS, IDENTITY)
    comparison.result()
    assert len(comparison._reference.poses) + len(comparison._estimate.poses) == LARGEST_BACKLOG
