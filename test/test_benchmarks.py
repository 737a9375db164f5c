"""What benchmark/all.py calls slower."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent / 'benchmark'))

from ratio_changes import changes
from ratios import Ratio, read_ratios, write_ratios


@pytest.mark.parametrize(
    ('before', 'now', 'is_slower'),
    [
        ([1.0, 1.1], [1.3, 1.4], True),
        ([1.0, 1.5], [1.4, 1.6], False),  # rounds overlap
        ([1.0, 1.0], [1.05, 1.05], False),  # too little
        ([1.3, 1.4], [1.0, 1.1], False),
    ],
)
def test_slower_is_what_exceeds_the_spread_of_the_rounds(before, now, is_slower):
    [change] = changes([Ratio('trial', 'bare stepping', before)], [Ratio('trial', 'bare stepping', now)])
    assert change.is_slower is is_slower


def test_what_only_one_run_has_is_not_compared():
    assert changes([Ratio('a', 's', [1.0])], [Ratio('b', 's', [2.0]), Ratio('a', 'ms', [2.0])]) == []


def test_ratios_are_read_as_they_were_written(tmp_path):
    ratios = [Ratio('a', 's', [1.0, 2.5], 3.0), Ratio('b', 'ms', [0.125])]
    write_ratios(tmp_path / 'ratios.json', ratios)
    assert read_ratios(tmp_path / 'ratios.json') == ratios
