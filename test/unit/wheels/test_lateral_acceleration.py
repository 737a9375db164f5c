import pytest

from diff_encoder_sim.wheels.covariance import LateralAcceleration

SEPARATION_M = 0.4


def after(seconds, left_mps, right_mps, interval_s=0.02):
    pull = LateralAcceleration(SEPARATION_M)
    for _ in range(round(seconds / interval_s)):
        last = pull.take(interval_s, left_mps * interval_s, right_mps * interval_s)
    return last


@pytest.mark.parametrize('interval_s', [0.001, 0.02, 0.1])
def test_in_a_curve_it_is_speed_times_turn_at_any_rate_of_reports(interval_s):
    # 0.4 m/s and 0.5 rad/s.
    assert after(4.0, 0.3, 0.5, interval_s) == pytest.approx(0.2, rel=1e-3)
    assert after(4.0, 0.5, 0.3, interval_s) == pytest.approx(-0.2, rel=1e-3)
    assert after(4.0, -0.3, -0.5, interval_s) == pytest.approx(0.2, rel=1e-3)  # backwards


def test_pulses_of_a_coarse_straight_line_weigh_little():
    pull, d_m = LateralAcceleration(SEPARATION_M), 0.0157  # 40 PPR: the wheels take turns in passing a pulse
    squares = [pull.take(0.02, d_m * (step % 2), d_m * ((step + 1) % 2)) ** 2 for step in range(500)]
    assert sum(squares[100:]) / 400 < 0.01 * (0.39 * 1.0) ** 2
