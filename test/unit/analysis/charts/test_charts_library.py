"""The library that pages have in them is the one that its README names."""

import hashlib
import re

import pytest

from diff_encoder_sim.analysis.charts.page_part import LIBRARY, SCRIPTS

README = (LIBRARY / 'README.md').read_text(encoding='utf-8')


@pytest.mark.parametrize('name', SCRIPTS)
def test_each_script_is_as_it_was_published(name):
    sums = dict(line.split()[::-1] for line in (LIBRARY / 'SHA256SUMS').read_text(encoding='ascii').splitlines())
    assert hashlib.sha256((LIBRARY / name).read_bytes()).hexdigest() == sums[f'./{name}']


@pytest.mark.parametrize('name', SCRIPTS)
def test_its_version_is_that_of_the_readme(name):
    text = (LIBRARY / name).read_text(encoding='utf-8')
    [version] = re.findall(rf'^\| `{re.escape(name)}` \| [\w-]+ \| ([\d.]+) \|', README, re.MULTILINE)
    assert re.search(rf'[=:]"{re.escape(version)}"', text)
    assert f'{name.partition(".")[0]}@{version}' in README


@pytest.mark.parametrize('name', SCRIPTS)
def test_it_may_stand_in_a_page(name):
    """The end of a script, and the start of a comment, would end or change it."""
    assert not re.search(r'</script|<!--', (LIBRARY / name).read_text(encoding='utf-8'), re.IGNORECASE)


@pytest.mark.parametrize('name', SCRIPTS)
def test_its_licence_stands_beside_it(name):
    licence = (LIBRARY / f'LICENSE-{name.partition(".")[0]}').read_text(encoding='utf-8')
    assert licence.startswith('Copyright (c) 2015') and 'Redistribution and use' in licence
