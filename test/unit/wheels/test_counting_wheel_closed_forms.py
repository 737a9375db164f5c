"""Odometry's errors by those of the encoder, against the closed forms of docs/encoders.md, over seeds."""

import math

import numpy as np
import pytest
from scipy import stats

from encoder_drives import RADIUS_M, SEPARATION_M, drive, m_per_pulse, straight_drive

SEEDS, LENGTH_M = 60, 5.0


def assert_std(values, expected):
    """Within the 99.9 % interval of the standard deviation of Gaussian values."""
    low, high = stats.chi2.ppf([0.0005, 0.9995], len(values) - 1) / (len(values) - 1)
    assert expected * math.sqrt(low) < np.std(values, ddof=1) < expected * math.sqrt(high)


def lateral_m(ppr, encoder):
    estimates = [straight_drive(LENGTH_M, seed, ppr, encoder, speed_mps=2.0) for seed in range(SEEDS)]
    return np.array([estimate.base_pose_in_odom.y_m for estimate in estimates]), estimates


@pytest.mark.parametrize('decoding', ['x1', 'x4'])
def test_misplaced_edges(decoding):
    across_m, _ = lateral_m(1024, {'edge_error': 0.25, 'decoding': decoding})
    assert_std(across_m, LENGTH_M * m_per_pulse(1024) / SEPARATION_M * math.sqrt(1 / 6 + 2 * 0.25**2))


def test_eccentricity():
    across_m, _ = lateral_m(4096, {'eccentricity': 0.02})
    assert_std(across_m, LENGTH_M * RADIUS_M * 0.02 / SEPARATION_M)


def test_missed_counts():
    missed = 0.02
    across_m, estimates = lateral_m(1024, {'faults': {'missed': missed}})
    heading_rad = math.sqrt(2 * LENGTH_M * m_per_pulse(1024) * missed * (1 - missed)) / SEPARATION_M
    assert_std([estimate.base_pose_in_odom.yaw_rad for estimate in estimates], heading_rad)
    assert_std(across_m, heading_rad * LENGTH_M / math.sqrt(3))
    along_m = np.mean([estimate.base_pose_in_odom.x_m for estimate in estimates])
    assert along_m == pytest.approx(LENGTH_M * (1 - missed), abs=0.01)


def test_backlash_turns_the_heading_at_each_reversal_and_back_at_the_next():
    backlash_rad = 0.05
    one_way = np.linspace(0.0, 10.0, 400)
    there_and_back = np.concatenate([one_way, one_way[::-1], one_way])
    turned = np.column_stack([there_and_back, np.full(len(there_and_back), 0.0)])
    encoder = {'lines': 1000, 'side': 'motor', 'gear_ratio': 10.0, 'backlash': backlash_rad}
    yaw_rad = np.array([estimate.base_pose_in_odom.yaw_rad for estimate in drive(turned, 1, 90, encoder)])
    true_rad = -RADIUS_M * there_and_back[::5] / SEPARATION_M
    error_rad = np.array([math.remainder(error, 2 * math.pi) for error in yaw_rad - true_rad[: len(yaw_rad)]])
    forward, backward, forward_again = (error_rad[part] for part in (slice(60, 75), slice(120, 150), slice(200, 230)))
    assert backward - forward.mean() == pytest.approx(np.full(30, RADIUS_M * backlash_rad / SEPARATION_M), abs=2e-4)
    assert forward_again == pytest.approx(np.full(30, forward.mean()), abs=2e-4)


@pytest.mark.parametrize(
    'encoder', [{'edge_error': 0.25}, {'eccentricity': 0.02}, {'sensor': 'hall', 'sensor_error': 12.0}]
)
def test_the_stated_covariance_knows_the_sensor(encoder):
    """NEES of the heading and of the lateral position, without slip."""
    ppr = 90 if 'sensor' in encoder else 1024
    estimates = [straight_drive(LENGTH_M, seed, ppr, encoder, speed_mps=2.0) for seed in range(SEEDS)]
    across = [e.base_pose_in_odom.y_m / math.sqrt(e.pose_covariance[1, 1]) for e in estimates]
    assert_std(across, 1.0)
