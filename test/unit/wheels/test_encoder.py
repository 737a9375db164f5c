"""A wheel's encoder: gear, sensor, decoder, faults, and all of them together."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

from diff_encoder_sim.wheels.encoder import CountFaults, Gear, HitCounts, Play, WheelSensor, counts_of_states
from diff_encoder_sim.wheels.encoder_params import EncoderModel, FaultParams
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams, ReportingEncoder
from encoder_drives import JOINTS, RADIUS_M, SEPARATION_M, TICK_NS, counts, drive, m_per_pulse, straight_drive


def gear(ratio, backlash_rad, seed=1):
    return Gear(ratio, backlash_rad, np.random.default_rng(seed))


def test_play_is_taken_up_before_anything_follows():
    play = Play(0.2, 1.0)
    assert [play.follow(at) for at in (1.0, 1.1, 1.3, 1.2, 1.1, 1.0)] == pytest.approx([1.0, 1.0, 1.2, 1.2, 1.2, 1.1])


def test_the_motor_leads_by_half_of_the_play_in_either_direction():
    geared = gear(1.0, 0.1)
    geared.shaft_angle_rad(0.0)
    assert geared.shaft_angle_rad(1.0) == pytest.approx(1.05)
    assert geared.shaft_angle_rad(2.0) == pytest.approx(2.05)
    assert geared.shaft_angle_rad(1.5) == pytest.approx(1.45)


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


def counted(states, wiring='straight', is_dead=False, **keys):
    model = EncoderModel.from_mapping(keys, 'encoder')
    counts = counts_of_states(model, is_dead, wiring)
    return [counts.count(state) - counts.count(0) for state in states]


FORWARD = list(range(-4, 9))


@pytest.mark.parametrize(('decoding', 'edges'), [('x1', 4), ('x2', 2), ('x4', 1)])
def test_a_line_has_one_two_or_four_counts(decoding, edges):
    assert counted(FORWARD, decoding=decoding) == [state // edges for state in FORWARD]


@pytest.mark.parametrize('decoding', ['x1', 'x2', 'x4'])
@pytest.mark.parametrize('wiring', ['swapped', 'inverted'])
def test_wrong_wiring_counts_backward(decoding, wiring):
    assert counted([400], wiring, decoding=decoding) == [-400 // {'x1': 4, 'x2': 2, 'x4': 1}[decoding]]


def test_a_dead_channel_leaves_edges_that_come_and_go():
    dead = {'faults': {'dead_channel': 'B'}}
    assert counted(range(9), is_dead=True, **dead) == [0, 0, -1, -1, 0, 0, -1, -1, 0]
    assert counted(range(9), is_dead=True, decoding='x2', **dead) == [0, 0, -1, -1, 0, 0, -1, -1, 0]
    assert set(counted(range(9), is_dead=True, decoding='x2', faults={'dead_channel': 'A'})) == {0}


def test_by_the_command_a_dead_channel_leaves_half():
    assert counted([400], is_dead=True, direction='command', faults={'dead_channel': 'B'}) == [200]
    assert counted([400], direction='command') == [400]


@pytest.mark.parametrize(('decoding', 'expected'), [('x1', 100), ('x2', 200)])
def test_one_channel_has_two_edges_a_line(decoding, expected):
    assert counted([400], sensor='single_channel', decoding=decoding) == [expected]


def faults(seed=1, **keys):
    return CountFaults(FaultParams.from_mapping(keys, 'faults'), np.random.default_rng(seed))


@pytest.mark.parametrize(('fraction', 'burst'), [(0.01, 1.0), (0.3, 1.0), (1.0, 1.0), (0.05, 20.0)])
def test_the_fraction_is_chosen_in_bursts(fraction, burst):
    hits = HitCounts(fraction, burst, np.random.default_rng(1))
    chosen = np.array([hits.take(1) for _ in range(200_000)])
    assert chosen.mean() == pytest.approx(fraction, rel=0.1)
    lengths = np.diff(np.flatnonzero(np.diff(np.r_[0, chosen, 0])))[::2]
    if fraction < 0.1:
        assert lengths.mean() == pytest.approx(burst, rel=0.1)


@given(st.lists(st.integers(0, 50), max_size=40), st.floats(1e-6, 1.0), st.floats(1.0, 30.0), st.integers(0, 5))
def test_how_counts_are_split_does_not_matter(parts, fraction, burst, seed):
    whole, split = (HitCounts(fraction, burst, np.random.default_rng(seed)) for _ in range(2))
    assert sum(split.take(part) for part in parts) == whole.take(sum(parts))


def test_missed_and_extra_counts_go_the_way_of_the_wheel():
    assert faults(missed=1.0).counted(-7, 0, 10) == 0
    assert faults(extra=1.0).counted(-7, 0, 10) == -14
    assert faults(extra=1.0).counted(7, 0, 10) == 14
    assert faults(missed=0.5, extra=0.5).counted(0, 0, 10) == 0


def in_ticks(params, number, counts, tick_ns=10_000_000):
    """What the counter gets of equal counts in each of some ticks."""
    return sum(params.counted(counts, tick * tick_ns, (tick + 1) * tick_ns) for tick in range(number))


def test_what_comes_faster_than_the_limit_is_lost():
    assert in_ticks(faults(max_count_rate=1000.0), 100, 30) == 1000
    assert in_ticks(faults(max_count_rate=1000.0), 100, -9) == -900
    assert in_ticks(faults(max_count_rate=30.0), 100, 1) in (29, 30)  # a third of a count each time


@pytest.mark.parametrize('tick_ns', [100_000, 1_000_000, 10_000_000])
@pytest.mark.parametrize('share', [0.1, 0.5, 0.95])
@pytest.mark.parametrize('limit_hz', [50.0, 2000.0])
def test_below_the_limit_nothing_is_lost(tick_ns, share, limit_hz):
    """However many joint states come without a count."""
    counts = [math.floor(share * limit_hz * tick * tick_ns * 1e-9) for tick in range(5000)]
    steps = [(tick, now - before) for tick, (before, now) in enumerate(zip(counts, counts[1:])) if now > before]
    limited = faults(max_count_rate=limit_hz)
    counted = sum(limited.counted(step, tick * tick_ns, (tick + 1) * tick_ns) for tick, step in steps)
    assert counted == counts[-1]


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
