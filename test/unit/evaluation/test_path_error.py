"""Errors of a path as it comes, against the same of the whole path in arrays."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D
from diff_encoder_sim.evaluation.path_error import (
    LARGEST_BACKLOG,
    LARGEST_GAP_NS,
    RPE_DISTANCES_M,
    START_SPACING_M,
    PathComparison,
    RunningPathError,
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


def matrix(pose):
    cos, sin = math.cos(pose.yaw_rad), math.sin(pose.yaw_rad)
    return np.array([[cos, -sin, pose.x_m], [sin, cos, pose.y_m], [0.0, 0.0, 1.0]])


def test_against_matrices():
    estimate, reference = paths()
    running = RunningPathError()
    for pair in zip(estimate, reference):
        running.add(*pair)
    found = running.result()
    estimates, references = (
        [np.linalg.inv(matrix(path[0])) @ matrix(pose) for pose in path] for path in (estimate, reference)
    )
    offsets = np.array([(one - other)[:2, 2] for one, other in zip(estimates, references)])
    assert found.position_rmse_m == pytest.approx(math.sqrt((offsets**2).sum(axis=1).mean()))
    assert found.position_max_m == pytest.approx(np.hypot(*offsets.T).max())
    assert found.end[:2] == pytest.approx(offsets[-1])
    lengths = np.concatenate(
        ([0.0], np.cumsum([np.hypot(*(two - one)[:2, 2]) for one, two in zip(references, references[1:])]))
    )
    assert found.length_m == pytest.approx(lengths[-1]) and found.count == len(estimate)
    for distance_m in RPE_DISTANCES_M:
        check_relative(found.relative[distance_m], distance_m, estimates, references, lengths)


def check_relative(found, distance_m, estimates, references, lengths):
    starts, last_m = [], -math.inf
    for index, length_m in enumerate(lengths):
        if length_m - last_m >= START_SPACING_M:
            starts.append(index)
            last_m = length_m
    squares, yaws = [], []
    for start in starts:
        ends = np.flatnonzero(lengths - lengths[start] >= distance_m)
        if len(ends):
            true_step, step = (np.linalg.inv(path[start]) @ path[ends[0]] for path in (references, estimates))
            error = np.linalg.inv(true_step) @ step
            squares.append((error[:2, 2] ** 2).sum())
            yaws.append(math.atan2(error[1, 0], error[0, 0]) ** 2)
    assert found.count == len(squares) > 100
    assert found.position_rmse_m == pytest.approx(math.sqrt(np.mean(squares)))
    assert found.yaw_rmse_rad == pytest.approx(math.sqrt(np.mean(yaws)))


def test_a_path_is_compared_with_itself_wherever_it_lies():
    _, reference = paths()
    running = RunningPathError()
    for pose in reference:
        running.add(PLACE.inverse().compose(pose), pose)
    found = running.result()
    assert found.position_max_m < 1e-12 and found.yaw_rmse_rad < 1e-12
    assert all(relative.position_rmse_m < 1e-12 for relative in found.relative.values())


def test_without_a_pair_there_is_no_error():
    assert RunningPathError().result() is None


def test_a_robot_that_stands_begins_no_stretches():
    running = RunningPathError()
    for _ in range(5000):
        running.add(IDENTITY, PLACE)
    assert all(relative.count == 0 for relative in running.result().relative.values())
    assert all(len(stretches._open) <= 1 for stretches in running._stretches.values())


def straight(stamp_ns):
    return Pose2D(stamp_ns * 1e-9, 0.0, 0.1)


@pytest.mark.parametrize('lag', [-40, -1, 0, 1, 40], ids='reference lags by {}'.format)
def test_references_between_stamps_are_met_by_interpolation(lag):
    comparison, count = PathComparison(), 100
    for index in range(-50, count + 50):
        if 0 <= index < count:
            comparison.take_estimate(index * PERIOD_NS, straight(index * PERIOD_NS))
        late = index - lag
        if 0 <= late < count:
            stamp_ns = late * PERIOD_NS + PERIOD_NS // 3
            comparison.take_reference(stamp_ns, straight(stamp_ns))
    found = comparison.error.result()
    assert found.count == count - 1  # the last is beyond the estimate
    assert found.position_max_m < 1e-12


def test_equal_stamps_are_not_interpolated():
    comparison = PathComparison()
    for index, odd in enumerate([0.0, 1.0, 0.0, 1.0]):
        comparison.take_reference(index * PERIOD_NS, Pose2D(odd, 0.0, 0.0))
        comparison.take_estimate(index * PERIOD_NS, Pose2D(odd, 0.0, 0.0))
    assert comparison.error.result().position_max_m == 0.0


def test_no_error_is_made_up_in_a_gap():
    comparison = PathComparison()
    for stamp_ns in (0, LARGEST_GAP_NS + 1):
        comparison.take_estimate(stamp_ns, IDENTITY)
    comparison.take_reference(0, IDENTITY)
    comparison.take_reference(LARGEST_GAP_NS // 2, straight(0))
    assert comparison.error.result().count == 1


def test_time_that_jumps_back_begins_again_from_a_common_start():
    comparison = PathComparison()
    for offset in (IDENTITY, PLACE):
        for index in range(40):
            stamp_ns = index * PERIOD_NS
            comparison.take_reference(stamp_ns, straight(stamp_ns))
            comparison.take_estimate(stamp_ns, offset.compose(straight(stamp_ns)))
    found = comparison.error.result()
    assert found.count >= 79 and found.position_max_m < 1e-12


def test_what_waits_for_the_other_path_does_not_grow():
    comparison = PathComparison()
    for index in range(3 * LARGEST_BACKLOG):
        comparison.take_reference(index * PERIOD_NS, IDENTITY)
    assert len(comparison._references) == LARGEST_BACKLOG
