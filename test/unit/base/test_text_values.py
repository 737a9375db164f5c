"""Texts that are numbers, cells of spreadsheets, or whole numbers for the parameter server."""

import math

import pytest

from diff_encoder_sim.base.text_values import (
    LARGEST_INT,
    for_xml_rpc,
    from_xml_rpc,
    plain_float,
    plain_int,
    text_cell,
    text_of_cell,
)

NO_NUMBERS = ['', '7_0', '1_000.5', '\u0667\u0660', '1,5', '0x10', '1 2']


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


FORMULAS = ['=1+1', '+cmd', '-x', '@SUM(A1)', '\n=1', "'=1", '-', '-1 (A1)', "=cmd|'/C calc'!A0"]


AS_THEY_ARE = ['', 'name', '-0.5', '+3', '-1e-9', '-inf', '0', 'a=b', ' a', "'", "'a", '– ', '90-40', '[-1, 2]']


AS_THEY_ARE += ['-nan', '-.5', '-1.', '-0.033 (-0.039 to -0.025)', '-0.1 (-26 to 7e-3) ≠', '-1 to inf']


@pytest.mark.parametrize('text', FORMULAS)
def test_formulas_get_an_apostrophe_which_reading_removes(text):
    assert text_cell(text) == f"'{text}" and text_of_cell(text_cell(text)) == text


@pytest.mark.parametrize('text', AS_THEY_ARE)
def test_other_texts_and_numbers_are_kept(text):
    assert text_of_cell(text_cell(text)) == text_cell(text) == text


@pytest.mark.parametrize('number', [LARGEST_INT + 1, 2**32, -(2**40), 2**63 - 1])
def test_a_large_number_is_text_on_the_way(number):
    value = {'a': {'b': [1, number, 1e12, True, 'text']}}
    sent = for_xml_rpc(value)
    assert sent == {'a': {'b': [1, str(number), 1e12, True, 'text']}}
    assert from_xml_rpc(sent) == value


@pytest.mark.parametrize('value', [LARGEST_INT, -LARGEST_INT, 0, '90', '0100000000000', '1e12', None])
def test_what_fits_and_what_is_no_number_stays(value):
    assert for_xml_rpc(value) == from_xml_rpc(value) == value
