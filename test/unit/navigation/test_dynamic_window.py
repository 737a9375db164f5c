"""The dynamic window and its samples."""

import pytest

from diff_encoder_sim.navigation.dwa_kernels import dynamic_window, samples_between, velocity_samples, window_params
from navigation_scenes import PERIOD_S, dwa_params


def limits(**changes):
    return window_params(dwa_params(**changes), PERIOD_S)


def test_window_is_what_one_period_reaches():
    window = dynamic_window(limits(), 0.2, -0.3, 5.0)
    assert window == pytest.approx((0.165, 0.235, -0.545, -0.055))


def test_window_stays_within_the_limits():
    params = limits(min_vel_x=-0.1)
    assert dynamic_window(params, 0.44, 0.9, 5.0) == pytest.approx((0.405, 0.45, 0.655, 1.0))
    assert dynamic_window(params, -0.09, -1.0, 5.0)[:2] == pytest.approx((-0.1, -0.055))


def test_a_quantised_twist_above_the_limits_leaves_the_limits():
    """40 pulses: two pulses of each wheel in 50 ms are 0.63 m/s, of one wheel 1.57 rad/s."""
    assert dynamic_window(limits(), 0.628, 1.57, 5.0) == (0.45, 0.45, 1.0, 1.0)
    assert velocity_samples(limits(), 0.628, 1.57, 5.0).tolist() == [[0.45, 1.0]]


def test_without_dwa_the_window_spans_sim_time_and_does_not_overshoot():
    window = dynamic_window(limits(use_dwa=False), 0.1, 0.0, 0.34)
    assert window == pytest.approx((0.0, 0.2, -1.0, 1.0))


def test_samples_hold_both_ends_and_zero():
    assert samples_between(-0.245, 0.245, 4) == pytest.approx([-0.245, -0.0816667, 0.0, 0.0816667, 0.245])
    assert samples_between(0.1, 0.3, 3) == pytest.approx([0.1, 0.2, 0.3])
    assert samples_between(0.1, 0.3, 1).tolist() == [0.1, 0.3]
    assert samples_between(0.2, 0.2, 20).tolist() == [0.2]
    assert samples_between(-0.2, 0.2, 3).tolist() == [-0.2, 0.0, 0.2]  # it is there already


def test_default_sample_count_is_upstreams():
    """3 x 20, and one more turn of 0 where the window spans it."""
    assert len(velocity_samples(limits(), 0.2, 0.0, 5.0)) == 63
