"""The encoder's parameters: which values are refused, and how."""

import math

import pytest

from diff_encoder_sim.base.errors import ConfigError
from diff_encoder_sim.encoders.wheel_encoder import EncoderParams


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
    assert '\n' not in str(caught.value)
    if value != 'right_wheel_joint':
        assert f': {key}' in str(caught.value)


def test_a_number_stands_for_both_wheels():
    both = EncoderParams.from_mapping({'ppr': 40}, '')
    assert both == EncoderParams.from_mapping({'ppr': {'left': 40, 'right': 40}}, '')
    assert (both.ppr.left, both.ppr.right) == (40, 40)
