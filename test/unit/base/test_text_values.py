"""Whole numbers for the parameter server."""

import pytest

from diff_encoder_sim.base.text_values import LARGEST_INT, for_xml_rpc, from_xml_rpc


@pytest.mark.parametrize('number', [LARGEST_INT + 1, 2**32, -(2**40), 2**63 - 1])
def test_a_large_number_is_text_on_the_way(number):
    value = {'a': {'b': [1, number, 1e12, True, 'text']}}
    sent = for_xml_rpc(value)
    assert sent == {'a': {'b': [1, str(number), 1e12, True, 'text']}}
    assert from_xml_rpc(sent) == value


@pytest.mark.parametrize('value', [LARGEST_INT, -LARGEST_INT, 0, '90', '0100000000000', '1e12', None])
def test_what_fits_and_what_is_no_number_stays(value):
    assert for_xml_rpc(value) == from_xml_rpc(value) == value
