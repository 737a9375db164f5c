"""A wheel's encoder as a whole: gear, sensor, decoder and counter."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder
from encoder_drives import JOINTS, TICK_NS, counts

COUNT_RAD = 2.0 * math.pi / 1000


def both(angles_rad):
    return np.column_stack([angles_rad, angles_rad])


def wiggle(seed, size=500):
    return both(np.cumsum(np.random.default_rng(seed).normal(0.0, 0.05, size)))


IDEAL = [
    {},
    {'lines': 250},
    {'lines': 500, 'decoding': 'x2'},
    {'lines': 1000, 'decoding': 'x1'},
    {'lines': 10, 'gear_ratio': 25.0, 'side': 'motor'},
    {'sensor': 'hall'},
    {'sensor': 'absolute'},
]


@pytest.mark.parametrize('encoder', IDEAL)
def test_without_errors_each_sensor_counts_by_equation_1(encoder):
    # An error too small to move an edge: without any the chain is left out.
    negligible = {'faults': {'max_count_rate': 1e9}} if encoder.get('sensor') != 'absolute' else {'hysteresis': 1e-9}
    found = counts(wiggle(1), {**encoder, **negligible})
    assert (found == counts(wiggle(1), {}, ppr=1000)).mean() > 0.999  # else an angle on an edge, to rounding


def test_each_wheel_has_errors_of_its_own_by_the_seed():
    turned = both(np.linspace(0.0, 50.0, 2000))
    first, again, other = (counts(turned, {'edge_error': 0.2}, seed=seed) for seed in (1, 1, 2))
    assert (first == again).all() and (first != other).any() and (first[:, 0] != first[:, 1]).any()


chains = st.fixed_dictionaries(
    {},
    optional={
        'decoding': st.sampled_from(['x1', 'x2', 'x4']),
        'duty_cycle': st.floats(0.4, 0.6),
        'phase_error': st.floats(-20.0, 20.0),
        'edge_error': st.floats(0.0, 0.3),
        'eccentricity': st.floats(0.0, 0.4),
        'hysteresis': st.floats(0.0, 5.0),
        'backlash': st.floats(0.0, 0.3),
    },
)


@settings(max_examples=60, deadline=None)
@given(chains, st.lists(st.floats(0.0, 3.0), min_size=2, max_size=40), st.sampled_from([-1, 1]), st.integers(0, 99))
def test_counts_go_the_way_of_the_wheel_whatever_the_errors(chain, steps, way, seed):
    encoder = {**chain, 'side': 'motor', 'gear_ratio': 8.0, 'lines': 12}
    found = counts(both(way * np.cumsum(steps)), encoder, seed=seed)
    assert (np.diff(found, axis=0) * way >= 0).all()


def test_a_restart_sets_the_counters_to_zero_once():
    turned = both(COUNT_RAD * np.arange(100))
    found = counts(turned, {'faults': {'restart_at': 0.5, 'wheel': 'left'}})
    assert found[49:52, 0].tolist() == [49, 0, 1] and found[-1].tolist() == [49, 99]


@pytest.mark.parametrize(
    ('times', 'counted'),
    [
        ({}, 0),
        ({'dead_from': 0.2}, 20),
        ({'dead_for': 0.2}, 80),
        ({'dead_from': 0.1, 'dead_for': 0.1, 'dead_every': 0.3}, 70),
    ],
)
def test_a_dead_channel_counts_nothing_while_it_is_dead(times, counted):
    """Of A in x2, whose edges alone count; a hundred counts in a second."""
    found = counts(
        both(COUNT_RAD * (np.arange(101) + 0.5)), {'decoding': 'x2', 'faults': {'dead_channel': 'A', **times}}
    )
    assert found[-1, 0] == pytest.approx(counted, abs=1)


def test_by_the_command_the_sign_is_the_last_commanded_one():
    encoder = {'sensor': 'single_channel', 'decoding': 'x1', 'lines': 1000}
    reporting = ReportingEncoder(EncoderParams.from_mapping({'encoder': encoder, 'rate': 100.0}, 'test'))
    found = []
    for index, command in enumerate([1, 1, 0, -1, -1]):
        reporting.take_command(command, -command)
        angle_rad = COUNT_RAD * (10 * index + 0.5)
        found += reporting.update(index * TICK_NS, JOINTS, [angle_rad, angle_rad])
    # Forward while it coasts (0), then backward though the wheel turns on.
    assert [sample.left_pulses for sample in found] == [0, 10, 20, 10, 0]
    assert [sample.right_pulses for sample in found] == [0, -10, -20, -10, 0]
