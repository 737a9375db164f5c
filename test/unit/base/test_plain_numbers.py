"""Text is a number only if people and other programs read it as one."""

import math

import pytest

from diff_encoder_sim.base.text_values import plain_float, plain_int

NO_NUMBERS = [
    '',
    ' ',
    '7_0',
    '1_000.5',
    '1e1_0',
    '\u0667\u0660',
    '\u00b2',
    '1,5',
    '0x10',
    '--1',
    '.',
    'e5',
    'infinit',
    '1 2',
]


@pytest.mark.parametrize('text', ['7', '-7.5', '+.5', '5.', '1e-3', '1E+300', ' 2 ', '0100', '-inf', 'Infinity'])
def test_numbers_are_those_of_python(text):
    assert plain_float(text) == float(text)
    assert math.isnan(plain_float('NaN'))


@pytest.mark.parametrize('text', NO_NUMBERS)
def test_digits_with_underscores_or_of_other_scripts_are_none(text):
    with pytest.raises(ValueError, match='no number'):
        plain_float(text)
    with pytest.raises(ValueError, match='no whole number'):
        plain_int(text)


@pytest.mark.parametrize('text', ['1.0', '1e3', '9' * 5000, ' 2'])
def test_whole_numbers_have_digits_alone(text):
    with pytest.raises(ValueError, match='no whole number'):
        plain_int(text)
    assert (plain_int('-7'), plain_int('007')) == (-7, 7)
