"""ATE and RPE against closed forms: circles, lines and constant errors."""

import math

import numpy as np
import pytest

from diff_encoder_sim.base.se2 import Pose2D, PoseSeries
from diff_encoder_sim.drives.trajectory_error import Alignment, RpePairs, RunningRelativeErrors, path_error

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
