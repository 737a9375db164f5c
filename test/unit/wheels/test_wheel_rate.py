"""Speeds by the times of edges: their quantum, low speeds, reversal and standstill."""

import math

import numpy as np
import pytest

from diff_encoder_sim.wheels.wheel_encoder import DiffEncoder, EncoderParams
from diff_encoder_sim.wheels.wheel_rate import STANDSTILL_AFTER_S, TimedEdge, WheelRate

NS = 1_000_000_000
MS = 1_000_000
PPR = 40
RAD_PER_COUNT = 2 * math.pi / PPR
METHODS = ['T', 'MT']


def rates_of(motion, method, ppr=PPR, clock_hz=1e6, seconds=3.0, tick_ms=10):
    """[(time [s], left speed [rad/s])] of the reports while both wheels are at motion(time [s]) [rad]."""
    encoder = DiffEncoder(
        EncoderParams(ppr={'left': ppr, 'right': ppr}, velocity_method=method, velocity_clock=clock_hz)
    )
    rates = []
    for stamp_ms in range(0, int(1000 * seconds) + 1, tick_ms):
        angle_rad = motion(stamp_ms / 1000)
        sample = encoder.update(stamp_ms * MS, ('left_wheel_joint', 'right_wheel_joint'), (angle_rad, angle_rad))
        if sample is not None:
            rates.append((sample.stamp_ns / NS, sample.wheel_rates_radps[0]))
    return rates


def settled(rates, after_s=1.0):
    return [rate for time_s, rate in rates if time_s > after_s]


@pytest.mark.parametrize('method', METHODS)
@pytest.mark.parametrize('speed_radps', [0.5, 2.0, 4.5, 30.0, -4.5, -0.5])
@pytest.mark.parametrize('ppr', [40, 4096])
def test_a_steady_speed_is_measured_to_the_clocks_tick(method, speed_radps, ppr):
    """Where M at 40 PPR jumps between multiples of 3.1 rad/s."""
    rates = settled(rates_of(lambda time_s: speed_radps * time_s + 0.01, method, ppr))
    quantum = speed_radps**2 / (2 * math.pi / ppr * 1e6)
    assert rates == pytest.approx([speed_radps] * len(rates), abs=1.1 * quantum + 1e-6 * abs(speed_radps))


@pytest.mark.parametrize('clock_hz', [1e4, 1e5])
@pytest.mark.parametrize('speed_radps', [3.0, 10.0])
def test_ts_quantum_is_the_speed_squared_by_count_and_clock(speed_radps, clock_hz):
    """v^2 / (d f), to first order in the ticks between two edges; here in radians."""
    wheel, rng = WheelRate('T', RAD_PER_COUNT, clock_hz), np.random.default_rng(1)
    shown = set()
    for _ in range(2000):
        interval_ns = RAD_PER_COUNT / (speed_radps * rng.uniform(0.999, 1.001)) * NS
        begin_ns = rng.uniform(0, NS)
        wheel.take_edges(TimedEdge(begin_ns, 0, 1), TimedEdge(begin_ns + interval_ns, 1, 1))
        shown.add(wheel.report(int(begin_ns + interval_ns) + 1))
    ticks = RAD_PER_COUNT / speed_radps * clock_hz
    quantum = speed_radps**2 / (RAD_PER_COUNT * clock_hz)
    assert np.diff(sorted(shown)) == pytest.approx(quantum, rel=5 / ticks + 0.002)


def test_mt_is_the_mean_of_all_that_passed_between_its_edges():
    """T sees the last count alone: at a speed that changes, it is newer."""
    speed = {method: settled(rates_of(lambda time_s: 2.0 * time_s**2, method))[-1] for method in METHODS}
    assert speed['MT'] < speed['T'] < 4.0 * 3.0
    assert speed['T'] == pytest.approx(12.0, rel=0.02) and speed['MT'] == pytest.approx(12.0, rel=0.04)


@pytest.mark.parametrize('method', METHODS)
def test_a_reversal_shows_no_speed_of_either_side(method):
    """From 3 rad/s through standstill to -3 rad/s in 2 s: the measured speed lags, and never exceeds."""
    rates = rates_of(lambda time_s: 3.0 * time_s - 1.5 * time_s**2, method, seconds=2.0)
    for time_s, rate in rates:
        if time_s > 0.1:
            assert abs(rate) <= 3.0 + 1e-3
    assert all(rate > 0.0 for time_s, rate in rates if 0.1 < time_s < 0.9)
    assert all(rate < 0.0 for time_s, rate in rates if time_s > 1.5)
    assert rates[-1][1] == pytest.approx(-3.0, abs=0.3)


@pytest.mark.parametrize('method', METHODS)
def test_a_wheel_that_stops_decays_to_zero(method):
    """As fast as no edge excludes speeds, and after half a second altogether."""
    rates = rates_of(lambda time_s: 4.5 * min(time_s, 1.0), method)
    stopped = [(time_s - 1.0, rate) for time_s, rate in rates if time_s > 1.0]
    assert [rate for _, rate in stopped] == sorted((rate for _, rate in stopped), reverse=True)
    for since_s, rate in stopped:
        assert 0.0 <= rate <= RAD_PER_COUNT / since_s
        assert rate == 0.0 or since_s <= STANDSTILL_AFTER_S
    assert stopped[-1][1] == 0.0
