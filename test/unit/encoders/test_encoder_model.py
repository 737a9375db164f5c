"""What an encoder's parameters allow, and what follows from them."""

import math

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.encoders.encoder_model import EncoderModel, counts_per_turn
from diff_encoder_sim.encoders.pulses import PerWheel
from diff_encoder_sim.encoders.wheel_encoder import EncoderParams


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
        ({'sensor': 'hall', 'pole_pairs': 15, 'lines': 4}, 'no lines of sensor hall'),
        ({'sensor': 'hall', 'sensors': 4}, 'sensors: unknown key'),
        ({'backlash': 0.01}, 'side: motor'),
        ({'gear_ratio': 2.0}, 'side: motor'),
        ({'duty_cycle': 0.2, 'phase_error': 60}, 'in their order'),
        ({'eccentricity': 0.5, 'sensor': 'absolute', 'second_harmonic': 15.0}, 'rises with the true one'),
        ({'sensor': 'single_channel', 'lines': 20}, 'decoding x1 or x2'),
        ({'sensor': 'absolute', 'faults': {'missed': 0.1}}, 'counts nothing'),
        ({'sensor': 'absolute', 'faults': {'dead_channel': 'A'}}, 'dead_channel none'),
        ({'faults': {'dead_channel': 'C'}}, 'dead_channel none or A or B'),
        ({'faults': {'dead_every': 1.0}}, 'dead_for'),
        ({'lines': 300_000}, 'at most 1048576 counts'),
    ],
)
def test_a_bad_value_is_one_line(keys, words):
    with pytest.raises(ConfigError) as raised:
        model(**keys)
    assert words in str(raised.value) and '\n' not in str(raised.value)


def test_uneven_edges_need_a_whole_number_of_them():
    uneven = {'encoder': {'edge_error': 0.1}}
    EncoderParams.from_mapping({'ppr': 41, **uneven}, 'config')
    with pytest.raises(ConfigError, match='4 counts, or a multiple up to .*given 41 counts'):
        EncoderParams.from_mapping({'ppr': 41, 'encoder': {'duty_cycle': 0.4}}, 'config')
    with pytest.raises(ConfigError, match=r'given 1632\.67 counts'):
        EncoderParams.from_mapping({'ppr': 1632.67, **uneven}, 'config')
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
