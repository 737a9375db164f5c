"""Many encoders at once count what each of them counts by itself."""

import math

import numpy as np
import pytest

from diff_encoder_sim.wheels.drawn_counts import drawn_counts
from diff_encoder_sim.wheels.encoder import CountingWheel
from diff_encoder_sim.wheels.encoder_params import EncoderModel

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
