"""constraints/ pins every library that requirements*.txt asks for: equal seeds give equal bags with equal libraries."""

import re

import pytest

from places import ROOT

REQUIREMENTS = {
    '3.8': ('requirements.txt', 'requirements-test.txt'),
    '3.11': ('requirements.txt', 'requirements-test.txt', 'requirements-lint.txt', 'requirements-docs.txt'),
}


def required(files):
    text = ''.join((ROOT / file).read_text() for file in files)
    return {name.lower().replace('_', '-') for name in re.findall(r'^([A-Za-z0-9][\w.-]*)', text, re.MULTILINE)}


@pytest.mark.parametrize('version', sorted(REQUIREMENTS))
def test_every_required_library_has_one_exact_version(version):
    lines = (ROOT / 'constraints' / f'python{version}.txt').read_text().splitlines()
    pins = [re.fullmatch(r'([\w.-]+)==([\w.+-]+)', line) for line in lines if not line.startswith('#')]
    assert None not in pins
    names = [pin[1] for pin in pins]
    assert len(set(names)) == len(names)
    assert required(REQUIREMENTS[version]) <= set(names)
