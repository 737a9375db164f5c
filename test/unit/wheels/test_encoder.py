"""A wheel's encoder: equation (1), gear, sensor, decoder, faults, measured speed, and what they do to odometry."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from diff_encoder_sim.base.drive import Drive
from diff_encoder_sim.wheels.chain import Chain
from diff_encoder_sim.wheels.encoder import STANDSTILL_AFTER_S, pulses_from_angle
from diff_encoder_sim.wheels.odometry_params import OdometryParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams
from encoder_drives import RADIUS_M, SEPARATION_M, TICK_NS, m_per_pulse

TURN = 2.0 * math.pi
COUNT_RAD = TURN / 1000


def run(angles_rad, encoder=(), ppr=1000, draws=1, phases_rad=None, commands=None, tick_ns=TICK_NS, **params):
    """A drive of (n,) angles of both wheels, or (n, 2), or (draws, n, 2), with a report at each."""
    shared = {'ppr': ppr, 'encoder': dict(encoder)}
    odometry = OdometryParams.from_mapping({**shared, 'motion_noise': 0.0}, '')
    chain = Chain(EncoderParams.from_mapping({**shared, 'seed': 1, **params}, ''), odometry, draws)
    angles_rad = np.asarray(angles_rad, float)
    angles_rad = np.stack([angles_rad] * 2, axis=-1) if angles_rad.ndim == 1 else angles_rad
    rows = np.arange(angles_rad.shape[-2])
    return chain.run(Drive(tick_ns * rows, angles_rad), phases_rad, commands, rows)


def counts(angles_rad, encoder=(), **params):
    """(n, 2) of the first draw."""
    return run(angles_rad, encoder, **params).counts[0]


@pytest.mark.parametrize(
    ('angle_in_pulses', 'pulses'),
    [(0.0, 0), (0.99, 0), (1.01, 1), (-0.1, -1), (-1.0 - 1e-9, -2), (89.5, 89), (-90.5, -91)],
)
@pytest.mark.parametrize('ppr', [40, 4096])
def test_equation_1_floors_at_positive_and_negative_angles(angle_in_pulses, pulses, ppr):
    assert pulses_from_angle(TURN * angle_in_pulses / ppr, ppr) == pulses


SOUND = [
    {},
    {'lines': 250},
    {'lines': 500, 'decoding': 'x2'},
    {'lines': 1000, 'decoding': 'x1'},
    {'lines': 10, 'gear_ratio': 25.0, 'side': 'motor'},
    {'sensor': 'hall'},
    {'sensor': 'absolute'},
]


@pytest.mark.parametrize('encoder', SOUND)
def test_without_errors_each_sensor_counts_by_equation_1(encoder):
    # An error too small to move an edge: without any the chain is left out.
    negligible = {'faults': {'max_count_rate': 1e9}} if encoder.get('sensor') != 'absolute' else {'hysteresis': 1e-9}
    wiggle = np.cumsum(np.random.default_rng(1).normal(0.0, 0.05, 500))
    assert (counts(wiggle, {**encoder, **negligible}) == counts(wiggle)).mean() > 0.999  # an angle on an edge


def edges(encoder, ppr, fine=400):
    """(ppr,) places of the edges that are counted in a turn of the left wheel, in counts."""
    angles_rad = TURN / ppr * np.arange(-3.0, ppr + 2.0, 1.0 / fine)
    return np.searchsorted(counts(angles_rad, encoder, ppr=ppr)[:, 0], np.arange(ppr)) / fine - 3.0


def test_duty_cycle_and_phase_give_four_kinds_of_pulses():
    places = edges({'duty_cycle': 0.4, 'phase_error': 18.0}, 400)
    widths = np.diff(np.append(places, 400.0)).reshape(100, 4)
    assert widths == pytest.approx(np.tile([1.2, 0.4, 1.2, 1.2], (100, 1)), abs=0.01)


def test_three_halls_give_an_error_that_repeats_every_pole_pair():
    offsets = edges({'sensor': 'hall', 'sensor_error': 6.0}, 90) - np.arange(90)
    assert offsets == pytest.approx(np.tile(offsets[:3], 30), abs=0.01) and np.std(offsets[:3]) > 0.01


@pytest.mark.parametrize(('keys', 'per_turn'), [({'eccentricity': 0.01}, 1), ({'second_harmonic': 0.573}, 2)])
def test_eccentricity_and_harmonics_are_waves_of_the_shaft(keys, per_turn):
    sensor = {'sensor': 'absolute'} if per_turn == 2 else {}
    angles_rad = np.linspace(0.0, TURN, 721)[:-1]
    errors_rad = counts(angles_rad, {**keys, **sensor}, ppr=2**20)[:, 0] * TURN / 2**20 - angles_rad
    spectrum = np.abs(np.fft.rfft(errors_rad)) / 360
    assert spectrum[per_turn] == pytest.approx(0.01, rel=1e-3)
    assert np.delete(spectrum, [0, per_turn]).max() < 1e-6


def test_noise_is_new_with_each_reading_and_each_draw():
    found = run(np.full(4000, 100.5 * TURN / 4096), {'sensor': 'absolute', 'noise': 2.0}, 4096, draws=2).counts
    assert found.mean(axis=1) == pytest.approx(100.0, abs=0.15) and found.std(axis=1) == pytest.approx(2.0, rel=0.05)
    streams = np.vstack([found[0].T, found[1].T])
    assert np.abs(np.corrcoef(streams[:, 1:], streams[:, :-1]) - np.eye(8)).max() < 0.07


def test_hysteresis_shows_a_turn_back_later():
    places = np.array([0.0, 2.0, 5.0, 4.5, 4.0, 3.0])
    found = counts(TURN / 100 * (places + 0.25), {'hysteresis': 1.0}, ppr=100)[:, 0]
    assert found.tolist() == [0, 1, 4, 4, 4, 3]


def test_the_motor_leads_by_half_of_the_play_in_either_direction():
    turned = np.concatenate([np.linspace(0.0, 2.0, 50), [1.5]])
    motor = {'side': 'motor', 'gear_ratio': 1.0, 'backlash': 0.1}
    found = counts(turned, motor, ppr=1e6)[:, 0] * TURN / 1e6
    assert found[[25, 49, 50]] == pytest.approx([turned[25] + 0.05, 2.05, 1.45], abs=1e-5)
    starts = run(np.zeros(1), motor, 1e6, draws=500).counts[:, 0, 0] * TURN / 1e6
    assert stats.kstest(starts, 'uniform', (-0.05, 0.1)).pvalue > 1e-3


FORWARD = np.arange(-4, 9)


def decoded(states, faults=(), **keys):
    """Counts at states [edges], since the first."""
    edges_per_turn = 4000
    found = counts(TURN / edges_per_turn * (np.asarray(states) + 0.5), {**keys, 'lines': 1000, 'faults': dict(faults)})
    return (found[:, 0] - found[0, 0]).tolist()


@pytest.mark.parametrize(('decoding', 'edges'), [('x1', 4), ('x2', 2), ('x4', 1)])
def test_a_line_has_one_two_or_four_counts_and_wrong_wiring_counts_backward(decoding, edges):
    assert decoded(FORWARD, decoding=decoding) == (FORWARD // edges + 4 // edges).tolist()
    assert decoded(FORWARD[::-1], decoding=decoding)[-1] == -12 // edges
    for wiring in ('swapped', 'inverted'):
        assert decoded([0, 400], {'wiring': wiring}, decoding=decoding)[-1] == -400 // edges


def test_a_dead_channel_leaves_edges_that_come_and_go():
    dead = {'dead_channel': 'B'}
    assert decoded(range(9), dead) == [0, 0, -1, -1, 0, 0, -1, -1, 0]
    assert decoded(range(9), dead, decoding='x2') == [0, 0, -1, -1, 0, 0, -1, -1, 0]
    assert set(decoded(range(9), {'dead_channel': 'A'}, decoding='x2')) == {0}


def test_by_the_command_channels_count_edges():
    found = [decoded([0, 400], faults, direction='command')[-1] for faults in ({}, {'dead_channel': 'B'})]
    assert found == [400, 200]
    assert [decoded([0, 400], sensor='single_channel', decoding=each)[-1] for each in ('x1', 'x2')] == [100, 200]


def test_by_the_command_the_sign_is_the_last_commanded_one():
    commands = np.array([1, 1, 0, -1, -1])
    encoder = {'sensor': 'single_channel', 'decoding': 'x1', 'lines': 1000}
    angles_rad = COUNT_RAD * (10 * np.arange(5) + 0.5)
    found = counts(angles_rad, encoder, commands=np.column_stack([commands, -commands]))
    # Forward while it coasts (0), then backward though the wheel turns on.
    assert found.T.tolist() == [[0, 10, 20, 10, 0], [0, -10, -20, -10, 0]]


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
    """Of A in x2, whose edges only count; a hundred counts in a second."""
    faults = {'dead_channel': 'A', **times}
    found = counts(COUNT_RAD * (np.arange(101) + 0.5), {'decoding': 'x2', 'faults': faults})
    assert found[-1, 0] == pytest.approx(counted, abs=1)


def test_a_restart_sets_the_counters_to_zero_once():
    found = counts(COUNT_RAD * (np.arange(100) + 0.5), {'faults': {'restart_at': 0.5, 'wheel': 'left'}})
    assert found[49:52, 0].tolist() == [49, 0, 1] and found[-1].tolist() == [49, 99]


def evenly(number, per_tick=1):
    """Angles of a wheel that turns by some counts a tick."""
    return COUNT_RAD * (per_tick * np.arange(number + 1) + 0.5)


@pytest.mark.parametrize('burst', [1.0, 8.0])
@pytest.mark.parametrize(('fault', 'sign'), [('missed', -1), ('extra', 1)])
def test_counts_are_hit_as_often_as_asked_for_and_as_unevenly(fault, sign, burst):
    """Bursts of geometric lengths, whose variance over a long way is p n (1 - p) (2 b - 1), for a small p."""
    draws, p, number = 1000, 0.02, 20_000
    faults = {fault: p, f'{fault}_burst': burst}
    found = run(evenly(50, number // 50), {'faults': faults}, draws=draws).counts[:, -1, 0]
    hits = sign * (found - number)
    assert hits.mean() == pytest.approx(p * number, abs=5.0 * hits.std() / math.sqrt(draws))
    # A burst and the gap before it, both geometric, are a renewal process.
    gap = burst * (1.0 - p) / p
    cycle, variances = burst + gap, (burst * (burst - 1.0), gap * (gap + 1.0))
    expected = number * (variances[0] * gap**2 + variances[1] * burst**2) / cycle**3
    assert hits.var() == pytest.approx(expected, rel=0.15)


@pytest.mark.parametrize(
    ('faults', 'per_tick', 'expected'),
    [
        ({'missed': 1.0, 'extra': 1.0}, -7, -700),
        ({'max_count_rate': 1000.0}, 30, 1000),
        ({'max_count_rate': 1000.0}, -9, -900),
    ],
)
def test_missed_extra_and_too_fast_counts_go_the_way_of_the_wheel(faults, per_tick, expected):
    """In a second."""
    assert counts(evenly(100, per_tick), {'faults': faults})[-1, 0] == pytest.approx(expected, abs=1)


@pytest.mark.parametrize('tick_ns', [100_000, 10_000_000])
@pytest.mark.parametrize('share', [0.1, 0.95])
def test_below_the_limit_nothing_is_lost(tick_ns, share):
    """However many joint states have no count."""
    turned = COUNT_RAD * (0.5 + share * 2000.0 * np.arange(5000) * tick_ns * 1e-9)
    limited = counts(turned, {'faults': {'max_count_rate': 2000.0}}, tick_ns=tick_ns)
    np.testing.assert_array_equal(limited, counts(turned, tick_ns=tick_ns))


def test_each_wheel_and_draw_has_errors_of_its_own_by_the_seed():
    turned, encoder = np.linspace(0.0, 50.0, 2000), {'edge_error': 0.2}
    first, again, other = (run(turned, encoder, draws=3, seed=seed).counts for seed in (1, 1, 2))
    assert (first == again).all() and (first != other).any() and (first[0] != first[1]).any()
    assert (first[0, :, 0] != first[0, :, 1]).any()
    np.testing.assert_array_equal(run(turned, encoder, draws=1).counts[0], first[0])


def test_errors_do_not_depend_on_the_rate_of_angles():
    encoder = {'edge_error': 0.2, 'eccentricity': 0.02, 'faults': {'missed': 0.05, 'extra': 0.03, 'extra_burst': 4.0}}
    turned = np.linspace(0.0, 50.0, 2001)
    fine = counts(turned, encoder)
    np.testing.assert_array_equal(counts(turned[::10], encoder, tick_ns=10 * TICK_NS), fine[::10])


GEARED = {'side': 'motor', 'gear_ratio': 8.0, 'lines': 12, 'backlash': 0.3, 'hysteresis': 5.0}
STEPS = st.lists(st.floats(0.0, 3.0), min_size=2, max_size=40)
UNEVEN = {'duty_cycle': 0.4, 'phase_error': 20.0, 'edge_error': 0.3, 'eccentricity': 0.4}


@pytest.mark.parametrize('decoding', ['x1', 'x2', 'x4'])
@settings(max_examples=20, deadline=None)
@given(steps=STEPS, way=st.sampled_from([-1, 1]), seed=st.integers(0, 99))
def test_counts_go_the_way_of_the_wheel_whatever_the_errors(decoding, steps, way, seed):
    found = counts(way * np.cumsum(steps), {**GEARED, **UNEVEN, 'decoding': decoding}, seed=seed)
    assert (np.diff(found, axis=0) * way >= 0).all()


DRAWS, LENGTH_M = 1000, 5.0


def across_m(ppr, variance):
    """Of odometry after a straight drive: (S d / L) by the variance of both starts [counts^2]."""
    return LENGTH_M * m_per_pulse(ppr) / SEPARATION_M * math.sqrt(2 * (1 / 12 + variance))


@pytest.mark.parametrize(
    ('ppr', 'encoder', 'expected_m'),
    [
        (1024, {'edge_error': 0.25, 'decoding': 'x1'}, across_m(1024, 0.25**2)),
        (1024, {'edge_error': 0.25, 'decoding': 'x4'}, across_m(1024, 0.25**2)),
        (90, {'sensor': 'hall', 'sensor_error': 12.0}, across_m(90, 0.2**2)),
        (1024, {'sensor': 'absolute', 'noise': 1.0}, across_m(1024, 1.0)),
        (4096, {'eccentricity': 0.02}, LENGTH_M * RADIUS_M * 0.02 / SEPARATION_M),
    ],
)
def test_errors_of_the_sensor_move_the_end_as_their_closed_forms_and_the_stated_covariance(ppr, encoder, expected_m):
    """Without slip, from any phases of the wheels."""
    phases_rad = np.random.default_rng(2).uniform(0.0, TURN, (DRAWS, 2))
    found = run(np.linspace(0.0, LENGTH_M / RADIUS_M, 251), encoder, ppr, DRAWS, phases_rad)
    # Within the 99.9 % interval of the variance of Gaussian values.
    low, high = stats.chi2.ppf([0.0005, 0.9995], DRAWS - 1) / (DRAWS - 1)
    assert low < np.var(found.final_poses[:, 1], ddof=1) / expected_m**2 < high
    assert math.sqrt(found.estimates()[-1].of_pose.matrix()[1, 1]) == pytest.approx(expected_m, rel=0.03)


PPR = 40
RAD_PER_COUNT = TURN / PPR
METHODS = ['T', 'MT']


def rates_of(motion, method, ppr=PPR, clock_hz=1e6, seconds=3.0):
    """Times [s] and left speeds [rad/s] of the reports at 20 Hz while both wheels are at motion(times [s]) [rad]."""
    stamps_ns = TICK_NS * np.arange(round(seconds * 1e9 / TICK_NS) + 1)
    angles_rad = np.stack([motion(stamps_ns / 1e9)] * 2, axis=-1)
    params = EncoderParams.from_mapping({'ppr': ppr, 'velocity_method': method, 'velocity_clock': clock_hz}, '')
    found = Chain(params).run(Drive(stamps_ns, angles_rad))
    return found.stamps_ns[0] / 1e9, found.wheel_rates_radps[0, :, 0]


@pytest.mark.parametrize('method', METHODS)
@pytest.mark.parametrize('speed_radps', [0.5, 2.0, 4.5, 30.0, -4.5, -0.5])
@pytest.mark.parametrize('ppr', [40, 4096])
def test_a_steady_speed_is_measured_to_the_clocks_tick(method, speed_radps, ppr):
    """By M at 40 PPR it jumps between multiples of 3.1 rad/s."""
    times_s, rates = rates_of(lambda times_s: speed_radps * times_s + 0.01, method, ppr)
    quantum = speed_radps**2 / (TURN / ppr * 1e6)
    assert rates[times_s > 1.0] == pytest.approx(speed_radps, abs=1.1 * quantum + 1e-6 * abs(speed_radps))


def test_mt_is_the_mean_of_all_that_passed_between_its_edges():
    """T sees the last count only: at a speed that changes, it is newer."""
    speed = {method: rates_of(lambda times_s: 2.0 * times_s**2, method)[1][-1] for method in METHODS}
    assert speed['MT'] < speed['T'] < 4.0 * 3.0
    assert speed['T'] == pytest.approx(12.0, rel=0.02) and speed['MT'] == pytest.approx(12.0, rel=0.04)


@pytest.mark.parametrize('method', METHODS)
def test_a_reversal_shows_no_speed_of_either_side_and_a_stop_decays_to_zero(method):
    """From 3 rad/s through standstill to -3 rad/s in 2 s: the measured speed lags, and never exceeds."""
    times_s, rates = rates_of(lambda times_s: 3.0 * times_s - 1.5 * times_s**2, method, seconds=2.0)
    assert np.abs(rates).max() <= 3.0 + 1e-3
    assert (rates[(times_s > 0.1) & (times_s < 0.9)] > 0.0).all() and (rates[times_s > 1.5] < 0.0).all()
    assert rates[-1] == pytest.approx(-3.0, abs=0.3)
    # As fast as no edge excludes speeds, and after half a second altogether.
    times_s, rates = rates_of(lambda times_s: 4.5 * np.minimum(times_s, 1.0), method)
    since_s, rates = times_s[times_s > 1.0] - 1.0, rates[times_s > 1.0]
    assert (np.diff(rates) <= 0.0).all() and (rates >= 0.0).all() and (rates <= RAD_PER_COUNT / since_s).all()
    assert (rates[since_s > STANDSTILL_AFTER_S] == 0.0).all() and rates[-1] == 0.0
