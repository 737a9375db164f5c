"""Texts that a spreadsheet would execute, and numbers that it must not take for texts."""

import pytest

from diff_encoder_sim.base.text_values import text_cell, text_of_cell

FORMULAS = [
    '=1+1',
    '+cmd',
    '-x',
    '@SUM(A1)',
    '\t=1',
    '\r=1',
    '\n=1',
    "'=1",
    "''-x",
    '=',
    '-',
    '-1-1',
    '-1 (A1)',
    '-1_0',
    "=cmd|'/C calc'!A0",
]
AS_THEY_ARE = ['', 'name', '-0.5', '+3', '-1e-9', '-inf', '0', 'a=b', ' a', "'", "'a", '– ', '90-40', '[-1, 2]']
AS_THEY_ARE += ['-nan', '-.5', '-1.', '-0.033 (-0.039 to -0.025)', '-0.1 (-26 to 7e-3) ≠', '-1 to inf']


@pytest.mark.parametrize('text', FORMULAS)
def test_formulas_get_an_apostrophe_which_reading_removes(text):
    assert text_cell(text) == f"'{text}" and text_of_cell(text_cell(text)) == text


@pytest.mark.parametrize('text', AS_THEY_ARE)
def test_other_texts_and_numbers_are_kept(text):
    assert text_of_cell(text_cell(text)) == text_cell(text) == text
