"""Errors of a path as it comes, against the same of the whole path in arrays."""

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import IDENTITY, Pose2D, PoseSeries
from diff_encoder_sim.drives.trajectory_error import Alignment, PathComparison, RunningPathError, path_error
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
