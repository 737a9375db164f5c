"""What an encoder's parameters allow, and what follows from them."""

import math

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.wheels.encoder_params import EncoderModel, PerWheel, counts_per_turn
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams


def model(**keys):
    return EncoderModel.from_mapping(keys, 'encoder')


@pytest.mark.parametrize(
    ('keys', 'expected'),
    [
        ({'lines': 12, 'decoding': 'x4', 'gear_ratio': 34.014, 'side': 'motor'}, 1632.672),
        ({'lines': 12, 'decoding': 'x1', 'gear_ratio': 34.014, 'side': 'motor'}, 408.168),
        ({'lines': 500, 'decoding': 'x2'}, 1000),
        ({'sensor': 'hall', 'pole_pairs': 15}, 90),
        ({'sensor': 'single_channel', 'lines': 20, 'decoding': 'x2'}, 40),
        ({'sensor': 'absolute', 'bits': 14}, 16384),
        ({'lines': 13, 'gear_ratio': 6545 / 132, 'side': 'motor'}, 2578.3333333333335),
    ],
)
def test_counts_per_wheel_turn_are_lines_times_decoding_times_gear(keys, expected):
    assert model(**keys).counts_per_wheel_turn == pytest.approx(expected)
    assert counts_per_turn(PerWheel(left=7, right=7), model(**keys)).left == pytest.approx(expected)


def test_without_a_resolution_of_its_own_ppr_tells():
    assert counts_per_turn(PerWheel(left=40, right=90), model(edge_error=0.1)) == PerWheel(left=40, right=90)


@pytest.mark.parametrize(
    ('keys', 'words'),
    [
        ({'gear_ratio': 0}, 'gear_ratio: given 0'),
        ({'decoding': 'x5'}, "decoding: given 'x5'"),
        ({'faults': {'missed': 1.2}}, 'faults.missed: given 1.2'),
        ({'side': 'motor', 'backlash': -0.1}, 'backlash: given -0.1'),
        ({'sensor': 'hall', 'lines': 4}, 'lines: given 4; allowed: with sensor quadrature or single_channel, not hall'),
        ({'sensor': 'hall', 'noise': 1.0}, 'noise: given 1.0; allowed: with sensor absolute, not hall'),
        ({'sensors': 'hall'}, "sensors: unknown key; did you mean 'sensor'?"),
        ({'backlash': 0.01}, 'backlash: given 0.01; allowed: 0.0 with side wheel, or side motor'),
        ({'gear_ratio': 2.0}, 'gear_ratio: given 2.0; allowed: 1.0 with side wheel, or side motor'),
        (
            {'duty_cycle': 0.2, 'phase_error': 60},
            'duty_cycle: given 0.2; allowed: 0.429 to 0.571, with phase_error 60.0',
        ),
        ({'duty_cycle': 0.9, 'phase_error': -20}, 'allowed: 0.207 to 0.793, with phase_error -20.0'),
        (
            {'eccentricity': 0.5, 'sensor': 'absolute', 'second_harmonic': 15.0},
            'second_harmonic: given 15.0; allowed: up to 14.037, with eccentricity 0.5 and first_harmonic 0.0',
        ),
        ({'sensor': 'single_channel'}, "decoding: given 'x4'; allowed: x1 or x2, with sensor single_channel"),
        ({'sensor': 'absolute', 'direction': 'command'}, 'allowed: phases, with sensor absolute'),
        ({'sensor': 'absolute', 'faults': {'missed': 0.1}}, 'faults.missed: given 0.1; allowed: 0.0 with'),
        ({'sensor': 'absolute', 'faults': {'restart_at': 5.0}}, 'faults.restart_at: given 5.0; allowed: 0.0 with'),
        ({'sensor': 'absolute', 'faults': {'dead_channel': 'A'}}, 'allowed: none, with sensor absolute'),
        (
            {'sensor': 'absolute', 'faults': {'wiring': 'swapped'}},
            'allowed: straight or inverted, with sensor absolute',
        ),
        ({'faults': {'dead_channel': 'C'}}, "faults.dead_channel: given 'C'; allowed: none, A or B, with sensor"),
        (
            {'faults': {'dead_every': 1.0, 'dead_for': 2.0}},
            'faults.dead_for: given 2.0; allowed: above 0.0, and at most',
        ),
        ({'lines': 300_000}, 'lines: given 300000; allowed: up to 262144, with decoding x4'),
    ],
)
def test_a_bad_value_is_one_line(keys, words):
    with pytest.raises(ConfigError) as raised:
        model(**keys)
    assert words in str(raised.value) and '\n' not in str(raised.value)


def test_uneven_edges_need_a_whole_number_of_them():
    uneven = {'encoder': {'edge_error': 0.1}}
    EncoderParams.from_mapping({'ppr': 41, **uneven}, 'config')
    with pytest.raises(ConfigError, match=r'^config: ppr: given 41\.0; allowed: multiples of 4 up to 1048576'):
        EncoderParams.from_mapping({'ppr': 41, 'encoder': {'duty_cycle': 0.4}}, 'config')
    with pytest.raises(ConfigError, match=r'ppr: given 1632\.67; allowed: multiples of 1 up to'):
        EncoderParams.from_mapping({'ppr': 1632.67, **uneven}, 'config')
    geared = {'duty_cycle': 0.4, 'gear_ratio': 34.014, 'side': 'motor'}
    with pytest.raises(ConfigError, match=r'ppr: given 100\.0; allowed: multiples of 136\.056 up to'):
        EncoderParams.from_mapping({'ppr': 100, 'encoder': geared}, 'config')
    EncoderParams.from_mapping({'ppr': 2 * 136.056, 'encoder': geared}, 'config')
    motor = {'lines': 12, 'gear_ratio': 34.014, 'side': 'motor', 'edge_error': 0.1}
    EncoderParams.from_mapping({'encoder': motor}, 'config')


def test_the_variance_of_a_reading_is_the_sum_of_its_errors():
    assert model().pulse_variance(100) == 0.0
    assert model(edge_error=0.2).pulse_variance(100) == pytest.approx(0.04)
    per_rad = 1000 / (2 * math.pi)
    assert model(eccentricity=0.01).pulse_variance(1000) == pytest.approx((0.01 * per_rad) ** 2 / 2)
    on_motor = {'side': 'motor', 'gear_ratio': 30.0}
    assert model(eccentricity=0.01, **on_motor).pulse_variance(1000) == pytest.approx((0.01 * per_rad / 30) ** 2 / 2)
    assert model(backlash=0.02, **on_motor).pulse_variance(1000) == pytest.approx((0.02 * per_rad) ** 2 / 12)
    assert model(sensor='hall', sensor_error=6.0).pulse_variance(90) == pytest.approx(0.01)
    # Edges at 0, 1, 1.6 and 2.6 of four: 0, 0, -0.4 and -0.4 off, of a mean of -0.2.
    assert model(duty_cycle=0.4).pulse_variance(100) == pytest.approx(0.04)
