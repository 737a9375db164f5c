"""Numbers on the command line are within their bounds, or what is allowed is said."""

import argparse

import pytest

from diff_encoder_sim.base.bounds import Between
from diff_encoder_sim.base.command_line import number_within, whole_number_within


@pytest.mark.parametrize(
    'text', ['0', '-1', 'nan', 'inf', 'ninety', '', '7_0', '\u0667\u0660', '1_0.5', '1e300', '1e-300', '1' + '0' * 400]
)
def test_numbers_are_within_their_bounds(text):
    parse = number_within(Between(1e-3, 1e9, 'm'))
    with pytest.raises(argparse.ArgumentTypeError, match=r'^given .*; allowed: 0\.001 to 1e9 \[m\]$'):
        parse(text)
    assert parse('1632.67') == 1632.67


@pytest.mark.parametrize('text', ['0', '-1', '1.5', '1e3', '7_0', '\u0663', '', '1001', '9' * 5000])
def test_counts_are_whole_numbers_within_their_bounds(text):
    parse = whole_number_within(Between(1, 1000))
    with pytest.raises(argparse.ArgumentTypeError, match='^given .*; allowed: a whole number, 1 to 1000$'):
        parse(text)
    assert parse('30') == 30
