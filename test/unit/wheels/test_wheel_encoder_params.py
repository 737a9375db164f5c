"""The encoder's parameters: which values are refused, and how."""

import math

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.wheels.wheel_encoder import EncoderParams


@pytest.mark.parametrize(
    ('key', 'value'),
    [
        ('ppr', 0),
        ('ppr', -90),
        ('ppr', math.nan),
        ('ppr', math.inf),
        ('ppr', 'ninety'),
        ('ppr', True),
        ('ppr', None),
        ('ppr', [90]),
        ('ppr', {'left': 90}),
        ('ppr', {'left': 90, 'right': 0}),
        ('ppr', {'left': 90, 'right': 90, 'middle': 1}),
        ('rate', 0),
        ('rate', '20'),
        ('rate', math.nan),
        ('rate', 1e9),
        ('counter_modulus', -1),
        ('counter_modulus', 1),
        ('counter_modulus', 2.5),
        ('counter_modulus', 2**64),
        ('left_joint', ''),
        ('left_joint', 3),
        ('left_joint', 'right_wheel_joint'),
    ],
)
def test_bad_encoder_values_are_refused_in_one_line(key, value):
    with pytest.raises(ConfigError, match=r'^robot\.yaml: ') as caught:
        EncoderParams.from_mapping({key: value}, 'robot.yaml')
    assert '\n' not in str(caught.value) and f': {key}' in str(caught.value)


def test_a_number_stands_for_both_wheels():
    both = EncoderParams.from_mapping({'ppr': 40}, '')
    assert both == EncoderParams.from_mapping({'ppr': {'left': 40, 'right': 40}}, '')
    assert (both.ppr.left, both.ppr.right) == (40, 40)


@pytest.mark.parametrize(
    ('rate', 'report', 'key', 'behind'),
    [
        (20.0, {'latency_spread': 2.0}, 'latency_spread: given 2.0', '2 s'),
        (20.0, {'latency_spread': 0.45, 'reordered': 0.1}, 'latency_spread: given 0.45', '0.525 s'),
        (1.0, {'latency_spread': 0.01, 'reordered': 0.1}, 'reordered: given 0.1', '1.51 s'),
        (1.0, {'repeated': 0.1}, 'repeated: given 0.1', '1 s'),
    ],
)
def test_reports_that_odometry_would_take_for_a_new_run_are_refused(rate, report, key, behind):
    text = (
        f'f: report.{key}; allowed: reports up to 0.5 s behind newer ones, not {behind} as with this report and rate '
    )
    with pytest.raises(ConfigError) as caught:
        EncoderParams.from_mapping({'rate': rate, 'report': report}, 'f')
    assert str(caught.value) == f'{text}{rate:g}; or stamps: arrival'
    EncoderParams.from_mapping({'rate': rate, 'report': {**report, 'stamps': 'arrival'}}, 'f')


@pytest.mark.parametrize(
    ('rate', 'report'), [(20.0, {'latency_spread': 0.5}), (3.0, {'reordered': 0.1}), (2.0, {'repeated': 0.1})]
)
def test_reports_as_late_as_odometry_tolerates_are_allowed(rate, report):
    EncoderParams.from_mapping({'rate': rate, 'report': report}, 'f')
