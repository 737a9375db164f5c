"""The library that pages have in them is the one that its README names."""

import hashlib

import pytest

from diff_encoder_sim.analysis.charts.page_part import LIBRARY, SCRIPTS

README = (LIBRARY / 'README.md').read_text(encoding='utf-8')


@pytest.mark.parametrize('name', SCRIPTS)
def test_each_script_is_as_it_was_published(name):
    sums = dict(line.split()[::-1] for line in (LIBRARY / 'SHA256SUMS').read_text(encoding='ascii').splitlines())
    assert hashlib.sha256((LIBRARY / name).read_bytes()).hexdigest() == sums[f'./{name}']
