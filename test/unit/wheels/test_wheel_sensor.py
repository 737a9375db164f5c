"""Where a sensor's edges are, and what it shows of an angle."""

import math

import numpy as np
import pytest

from diff_encoder_sim.wheels.encoder import WheelSensor
from diff_encoder_sim.wheels.encoder_params import EncoderModel


def sensor(counts_per_turn, seed=1, **keys):
    return WheelSensor(EncoderModel.from_mapping(keys, 'encoder'), counts_per_turn, np.random.default_rng(seed))


def edges_of(made, count):
    return np.array([made.place_of_edge(state) for state in range(count)])


def test_duty_cycle_and_phase_give_four_kinds_of_pulses():
    widths = np.diff(edges_of(sensor(400, duty_cycle=0.4, phase_error=18.0), 401)).reshape(100, 4)
    assert widths == pytest.approx(np.tile([1.2, 0.4, 1.2, 1.2], (100, 1)))


def test_three_halls_give_an_error_that_repeats_every_pole_pair():
    offsets = edges_of(sensor(90, sensor='hall', sensor_error=6.0), 90) - np.arange(90)
    assert offsets == pytest.approx(np.tile(offsets[:3], 30)) and len(set(offsets[:3])) == 3
    drawn = [edges_of(sensor(6, seed, sensor='hall', sensor_error=6.0), 3) - np.arange(3) for seed in range(2000)]
    assert np.std(drawn) == pytest.approx(6.0 / 60.0, rel=0.05)  # a count is 60 electrical degrees


@pytest.mark.parametrize('decoding', ['x1', 'x2', 'x4'])
def test_edges_are_off_by_as_much_as_was_asked_for_in_counts(decoding):
    edges_per_count = {'x1': 4, 'x2': 2, 'x4': 1}[decoding]
    made = sensor(10_000, edge_error=0.1, decoding=decoding)
    counted = np.array([made.place_of_edge(state) for state in range(0, 10_000 * edges_per_count, edges_per_count)])
    offsets = counted / edges_per_count - np.arange(10_000)
    assert offsets.std() == pytest.approx(0.1, rel=0.03) and abs(offsets.mean()) < 0.005


def test_edges_repeat_with_each_turn_and_keep_their_order():
    made = sensor(100, edge_error=0.3)
    places = edges_of(made, 300)
    assert (np.diff(places) >= 0.0).all()
    assert places[100:200] - places[:100] == pytest.approx(np.full(100, 100.0))
    for place in np.random.default_rng(3).uniform(-200, 200, 2000):
        state = made.state(place)
        assert made.place_of_edge(state) <= place < made.place_of_edge(state + 1)


@pytest.mark.parametrize(('keys', 'per_turn'), [({'eccentricity': 0.01}, 1), ({'second_harmonic': 0.573}, 2)])
def test_eccentricity_and_harmonics_are_waves_of_the_shaft(keys, per_turn):
    made = sensor(4096, **keys, **({'sensor': 'absolute'} if per_turn == 2 else {}))
    angles = np.linspace(0.0, 2.0 * math.pi, 721)[:-1]
    errors_rad = np.array([made.place(angle) for angle in angles]) * 2.0 * math.pi / 4096 - angles
    spectrum = np.abs(np.fft.rfft(errors_rad)) / 360
    assert spectrum[per_turn] == pytest.approx(0.01, rel=1e-3)
    assert np.delete(spectrum, per_turn).max() < 1e-9


def test_noise_is_new_with_each_reading():
    made = sensor(4096, sensor='absolute', noise=2.0)
    readings = [made.state(100.5) for _ in range(4000)]
    assert np.mean(readings) == pytest.approx(100.0, abs=0.15) and np.std(readings) == pytest.approx(2.0, rel=0.05)


def test_hysteresis_shows_a_turn_back_later():
    made = sensor(100, hysteresis=1.0)
    turn = 2.0 * math.pi / 100
    there = [made.place(count * turn) for count in (0.0, 2.0, 5.0)]
    back = [made.place(count * turn) for count in (4.5, 4.0, 3.0)]
    assert there + back == pytest.approx([0.0, 1.5, 4.5, 4.5, 4.5, 3.5])
