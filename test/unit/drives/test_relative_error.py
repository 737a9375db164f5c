"""RPE of pairs as they come: both conventions side by side, and paths that begin again."""

import numpy as np
import pytest

from diff_encoder_sim.drives.trajectory_error import RPE_DISTANCES_M, RpePairs, RunningRelativeErrors, rpe_name


def running_over(pairs):
    running = RunningRelativeErrors()
    running.add(pairs)
    return running


def line(count, step_m):
    """(count, 6) of a straight path, the same twice."""
    poses = np.zeros((count, 3))
    poses[:, 0] = step_m * np.arange(count)
    return np.hstack((poses, poses))


def test_names_of_columns():
    assert rpe_name(RpePairs.CONSECUTIVE, 10.0) == 'rpe_10m'
    assert rpe_name(RpePairs.ALL, 2.5) == 'rpe_2.5m_all_pairs'
    assert [pairs.text for pairs in RpePairs] == ['consecutive', 'all pairs']


def test_a_jump_is_in_one_of_the_consecutive_segments_and_in_each_of_all_pairs_that_hold_it():
    pairs = line(81, 0.25)
    pairs[41:, 1] = 0.4  # of the estimate, within the third of the segments of 5 m
    found = running_over(pairs).results()
    for convention, jumps in ((RpePairs.CONSECUTIVE, 1), (RpePairs.ALL, 20)):
        error = found[convention][5.0]
        assert error.translation_rmse_m == pytest.approx(0.4 * np.sqrt(jumps / error.segments))
        assert error.rotation_rmse_rad == 0.0


def test_a_restart_ends_all_segments():
    running, one = running_over(line(150, 0.125)), running_over(line(150, 0.125)).results()
    running.restart()
    running.add(line(150, 0.125))
    twice = running.results()
    for pairs in RpePairs:
        for distance_m in RPE_DISTANCES_M:
            assert twice[pairs][distance_m].segments == 2 * one[pairs][distance_m].segments
    assert running.length_m == pytest.approx(2 * 149 * 0.125)
