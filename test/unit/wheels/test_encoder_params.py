"""Parameters of encoders: allowed values and what follows from them."""

import math

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.wheels.encoder_params import EncoderModel
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams


def model(**keys):
    return EncoderModel.from_mapping(keys, 'encoder')


@pytest.mark.parametrize(
    ('keys', 'expected'),
    [
        ({'lines': 12, 'decoding': 'x4', 'gear_ratio': 34.014, 'side': 'motor'}, 1632.672),
        ({'lines': 12, 'decoding': 'x1', 'gear_ratio': 34.014, 'side': 'motor'}, 408.168),
        ({'sensor': 'hall', 'pole_pairs': 15}, 90),
        ({'sensor': 'single_channel', 'lines': 20, 'decoding': 'x2'}, 40),
        ({'sensor': 'absolute', 'bits': 14}, 16384),
    ],
)
def test_counts_per_wheel_turn_are_lines_times_decoding_times_gear(keys, expected):
    assert model(**keys).counts_per_wheel_turn == pytest.approx(expected)
    assert EncoderParams(encoder=model(**keys)).counts_per_turn.left == pytest.approx(expected)


GEARED = {'duty_cycle': 0.4, 'gear_ratio': 34.014, 'side': 'motor'}


@pytest.mark.parametrize(
    ('keys', 'words'),
    [
        ({'sensor': 'hall', 'lines': 4}, 'lines: given 4; allowed: with sensor quadrature or single_channel, not hall'),
        ({'backlash': 0.01}, 'backlash: given 0.01; allowed: 0.0 with side wheel'),
        ({'duty_cycle': 0.2, 'phase_error': 60}, 'duty_cycle: given 0.2; allowed: 0.429 to 0.571'),
        (
            {'eccentricity': 0.5, 'sensor': 'absolute', 'second_harmonic': 15.0},
            'second_harmonic: given 15.0; allowed: up',
        ),
        ({'sensor': 'single_channel'}, "decoding: given 'x4'; allowed: x1 or x2"),
        ({'sensor': 'absolute', 'faults': {'missed': 0.1}}, 'faults.missed: given 0.1; allowed: 0.0 with'),
        ({'sensor': 'absolute', 'faults': {'wiring': 'swapped'}}, "faults.wiring: given 'swapped'"),
        ({'faults': {'dead_channel': 'C'}}, "faults.dead_channel: given 'C'; allowed: none, A or B"),
        ({'faults': {'dead_every': 1.0, 'dead_for': 2.0}}, 'faults.dead_for: given 2.0; allowed: above 0.0'),
    ],
)
def test_keys_of_the_encoder_that_contradict_each_other_are_refused(keys, words):
    assert_refused({'encoder': keys}, f'encoder.{words}')


@pytest.mark.parametrize(
    ('params', 'words'),
    [
        *(({'ppr': bad}, 'ppr') for bad in (0, math.nan, 'ninety', {'left': 90})),
        ({'left_joint': 'right_wheel_joint'}, 'left_joint'),
        # Uneven edges need a whole number of them.
        ({'ppr': 41, 'encoder': {'duty_cycle': 0.4}}, 'ppr: given 41.0; allowed: multiples of 4 up to 1048576'),
        ({'ppr': 1632.67, 'encoder': {'edge_error': 0.1}}, 'ppr: given 1632.67; allowed: multiples of 1 up to'),
        ({'ppr': 100, 'encoder': GEARED}, 'ppr: given 100.0; allowed: multiples of 136.056 up to'),
        # Odometry would take late reports for a new run.
        *(
            (
                {'rate': rate, 'report': report},
                f'report.{key}; allowed: reports up to 0.5 s behind newer ones, not {behind}',
            )
            for rate, report, key, behind in (
                (20.0, {'latency_spread': 2.0}, 'latency_spread: given 2.0', '2 s'),
                (20.0, {'latency_spread': 0.45, 'reordered': 0.1}, 'latency_spread: given 0.45', '0.525 s'),
                (1.0, {'latency_spread': 0.01, 'reordered': 0.1}, 'reordered: given 0.1', '1.51 s'),
                (1.0, {'repeated': 0.1}, 'repeated: given 0.1', '1 s'),
            )
        ),
    ],
)
def test_bad_parameters_are_refused(params, words):
    assert_refused(params, words)


def assert_refused(params, words):
    with pytest.raises(ConfigError) as caught:
        EncoderParams.from_mapping(params, 'robot.yaml')
    assert str(caught.value).startswith(f'robot.yaml: {words}') and '\n' not in str(caught.value)


@pytest.mark.parametrize(('ppr', 'encoder'), [(41, {'edge_error': 0.1}), (2 * 136.056, GEARED)])
def test_uneven_edges_may_be_whole_turns_of_the_motor(ppr, encoder):
    assert EncoderParams.from_mapping({'ppr': ppr, 'encoder': encoder}, '').ppr.left == ppr


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
