"""The ten recipes of CONTRIBUTING.md: each is followed in a copy of the package, and its result works.

test/recipes/NAME.patch is what someone does who follows the recipe; NAME.py fails without it.
"""

import re
import shutil
import subprocess
import sys

import pytest

from places import ROOT

RECIPES = ROOT / 'test' / 'recipes'
NAMES = sorted(path.stem for path in RECIPES.glob('*.patch'))
MOST_FILES = 3
SECTION = re.compile(r'^### Add an? (.+)\n((?:(?!#).*\n)*)', re.MULTILINE)
LISTED = re.compile(r'`((?!test/)[a-z_]+/[a-z0-9_/]+\.py)`')
CHANGED = re.compile(r'^\+\+\+ b/src/diff_encoder_sim/(.+\.py)$', re.MULTILINE)


def sections():
    """The texts of the recipes by name."""
    found = SECTION.findall((ROOT / 'CONTRIBUTING.md').read_text(encoding='utf-8'))
    return {title.lower().replace(' ', '_'): text for title, text in found}


def test_the_page_has_these_ten_recipes():
    assert len(NAMES) == 10
    assert sorted(sections()) == NAMES


@pytest.mark.parametrize('name', NAMES)
def test_a_recipe_lists_the_files_that_it_changes(name):
    changed = set(CHANGED.findall((RECIPES / f'{name}.patch').read_text(encoding='utf-8')))
    assert set(LISTED.findall(sections()[name])) == changed
    assert len(changed) <= MOST_FILES


@pytest.mark.long
@pytest.mark.timeout(200)
@pytest.mark.parametrize('name', NAMES)
def test_a_recipe_works(name, tmp_path):
    for folder in ('src', 'config', 'worlds', 'urdf'):
        shutil.copytree(ROOT / folder, tmp_path / folder)  # with the compiled kernels, whose key is the file's time
    shutil.copy(ROOT / 'package.xml', tmp_path)
    assert run([sys.executable, RECIPES / f'{name}.py'], tmp_path) != 0, 'it works without the recipe'
    shutil.rmtree(tmp_path / 'made', ignore_errors=True)
    assert run(['git', 'apply', '--unsafe-paths', RECIPES / f'{name}.patch'], tmp_path) == 0
    assert run([sys.executable, RECIPES / f'{name}.py'], tmp_path) == 0


def run(command, checkout):
    environment = {'PYTHONPATH': str(checkout / 'src'), 'PATH': '/usr/bin:/bin', 'HOME': str(checkout)}
    return subprocess.run(list(map(str, command)), cwd=str(checkout), env=environment).returncode
