"""Draws at once count what each encoder counts by itself, and end where odometry ends one by one."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from diff_encoder_sim.wheels.drawn_counts import base_poses, drawn_counts, final_poses
from diff_encoder_sim.wheels.encoder import CountingWheel
from diff_encoder_sim.wheels.encoder_params import EncoderModel
from diff_encoder_sim.wheels.odometry import WheelOdometry
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder
from encoder_drives import JOINTS, SEPARATION_M, TICK_NS, m_per_pulse

DRAWS, SAMPLES, PERIOD_S = 5, 300, 0.01

TIMES_S = PERIOD_S * np.arange(SAMPLES)

MODELS = {
    'ideal': {},
    'edges': {'edge_error': 0.2},
    'eccentricity': {'eccentricity': 0.05},
    'pattern of x2': {'decoding': 'x2', 'duty_cycle': 0.4},
    'pattern of x4': {'phase_error': 20.0, 'edge_error': 0.1},
    'hysteresis': {'hysteresis': 3.0},
    'backlash': {'side': 'motor', 'gear_ratio': 10.0, 'backlash': 0.1},
    'hall': {'sensor': 'hall', 'sensor_error': 8.0},
    'absolute': {'sensor': 'absolute', 'first_harmonic': 1.0, 'second_harmonic': 0.5, 'hysteresis': 2.0},
    'single channel': {'sensor': 'single_channel', 'decoding': 'x2', 'duty_cycle': 0.4},
    'inverted': {'faults': {'wiring': 'inverted'}},
    'dead channel': {'faults': {'dead_channel': 'A', 'dead_from': 0.505, 'dead_for': 0.2, 'dead_every': 1.0}},
}


def rngs(seed=0):
    return [np.random.default_rng([seed, draw]) for draw in range(DRAWS)]


def there_and_back(seed=1):
    """(draws, n) angles [rad] of wheels that turn, stop and turn back, 120 pulses a turn at most two a sample."""
    rng = np.random.default_rng(seed)
    turned = 1.5 * np.sin(np.linspace(0.0, 2.0 * math.pi, SAMPLES)) * rng.uniform(0.5, 1.5, (DRAWS, 1))
    return rng.uniform(0.0, 2.0 * math.pi, (DRAWS, 1)) + turned


def one_by_one(model, ppr, angles_rad, rngs):
    counted = []
    for row, rng in zip(angles_rad, rngs):
        wheel = CountingWheel(model, ppr, rng, rate=None)
        counts = []
        for before, time_s, angle in zip([row[0], *row], TIMES_S, row):
            wheel.command(1 if angle >= before else -1)
            wheel.turn_to(round(1e9 * time_s), angle)
            counts.append(wheel.count())
        counted.append(np.array(counts) - counts[0])
    return np.array(counted)


@pytest.mark.parametrize('name', MODELS)
def test_counts_are_those_of_one_by_one(name):
    model, angles = EncoderModel.model_validate(MODELS[name]), there_and_back()
    expected = one_by_one(model, 120.0, angles, rngs())
    assert np.ptp(expected) > 10
    np.testing.assert_array_equal(drawn_counts(model, 120.0, angles, TIMES_S, rngs()), expected)


@pytest.mark.parametrize('name', ['edges', 'eccentricity', 'pattern of x4', 'backlash'])
def test_draws_have_encoders_in_turn(name):
    model, angles = EncoderModel.model_validate(MODELS[name]), there_and_back()
    expected = one_by_one(model, 120.0, angles, [*rngs()[:2], *rngs()[:2], *rngs()[:1]])
    np.testing.assert_array_equal(drawn_counts(model, 120.0, angles, TIMES_S, rngs()[:2]), expected)


def evenly(draws, turns=40.0, samples=400):
    """(draws, n) angles of wheels that turn evenly, and (n,) times [s]."""
    phases = np.random.default_rng(3).uniform(0.0, 2.0 * math.pi, (draws, 1))
    return phases + np.linspace(0.0, 2.0 * math.pi * turns, samples), PERIOD_S * np.arange(samples)


@pytest.mark.parametrize('burst', [1.0, 8.0])
@pytest.mark.parametrize(('fault', 'sign'), [('missed', -1), ('extra', 1)])
def test_counts_are_missed_and_added_as_often_as_asked_for_and_as_unevenly(fault, sign, burst):
    draws, p, ppr = 400, 0.02, 500.0
    model = EncoderModel.model_validate({'faults': {fault: p, f'{fault}_burst': burst}})
    angles, times = evenly(draws)
    counted = drawn_counts(model, ppr, angles, times, [np.random.default_rng(i) for i in range(draws)])[:, -1]
    counts = 40.0 * ppr
    errors = sign * (counted - counts)
    # Starts of bursts are binomial, their lengths geometric: the variance of the sum of geometric numbers.
    expected_sd = math.sqrt(counts * p * (2.0 * burst - 1.0 - p * burst))
    assert np.mean(errors) == pytest.approx(counts * p, abs=4.0 * expected_sd / math.sqrt(draws) + 1.0)
    assert np.std(errors) == pytest.approx(expected_sd, rel=0.15)


REPORT_TICKS = 5


def nodes_one_by_one(angles_rad, ppr, axle_x_m):
    """The counts of the components that nodes run since the first, (reports, 2), and their final pose."""
    encoder = ReportingEncoder(EncoderParams(ppr=ppr))
    odometry = WheelOdometry(OdometryParams(ppr=ppr, max_wheel_speed=1e6, max_wheel_acceleration=1e9, axle_x=axle_x_m))
    counts = []
    for index, angles in enumerate(angles_rad.tolist()):
        for sample in encoder.update(index * REPORT_TICKS * TICK_NS, JOINTS, angles):
            estimate = odometry.update(*sample)
            counts.append(odometry.counts)
    return np.array(counts), estimate.base_pose_in_odom


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(2, 60),
    st.sampled_from([1, 40, 90, 1024, 8192]),
    st.floats(0.0, 3.0),
    st.sampled_from([0.0, 0.2]),
)
def test_any_drive_ends_as_one_by_one(seed, reports, ppr, step_rad, axle_x_m):
    rng = np.random.default_rng(seed)
    turned = np.cumsum(rng.uniform(-step_rad, step_rad, (reports, 2)), axis=0)
    singles = [nodes_one_by_one(turned + start, ppr, axle_x_m) for start in rng.uniform(0.0, 2.0 * math.pi, (3, 2))]
    ways_m = m_per_pulse(ppr) * np.array([counts for counts, _ in singles])
    many = base_poses(final_poses(ways_m[:, :, 0], ways_m[:, :, 1], SEPARATION_M), axle_x_m)
    for (x_m, y_m, yaw_rad), (_, pose) in zip(many, singles):
        assert (x_m, y_m) == pytest.approx((pose.x_m, pose.y_m), abs=1e-9)
        assert math.remainder(yaw_rad - pose.yaw_rad, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)


def test_a_straight_drive_spreads_as_the_closed_form_says():
    """(S d/L) sqrt(1/6) across and (d/L) sqrt(1/3) in heading, docs/adr/0002-odometry-covariance.md."""
    rng, length_m, draws = np.random.default_rng(1), 20.0, 4000
    pulse_m = m_per_pulse(360)
    lengths_m = length_m + rng.uniform(0.0, 0.1, (draws, 1))  # ends anywhere within a pulse
    pulses = lengths_m / pulse_m * np.linspace(0.0, 1.0, 400)
    left_m, right_m = (pulse_m * np.floor(rng.uniform(size=(draws, 1)) + pulses) for _ in range(2))
    poses = final_poses(left_m, right_m, SEPARATION_M)
    assert poses[:, 1].std() == pytest.approx(length_m * pulse_m / SEPARATION_M * math.sqrt(1 / 6), rel=0.05)
    assert poses[:, 2].std() == pytest.approx(pulse_m / SEPARATION_M * math.sqrt(1 / 3), rel=0.05)
