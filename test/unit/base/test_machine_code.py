"""An installation and a HOME that cannot be written, as in a container: kernels run, and use the code that is there."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import pytest

from places import SOURCE

KERNEL = """
from diff_encoder_sim.base.compiled import compiled

@compiled
def twice(x):
    return 2 * x
"""
CALL = """
import os, subprocess, sys
from diff_encoder_sim.room.kernel import twice

assert twice(float(sys.argv[1]) if '.' in sys.argv[1] else int(sys.argv[1])) == 6
print(len(twice.stats.cache_hits), len(twice.stats.cache_misses), twice.stats.cache_path)
print(os.environ.get('NUMBA_CACHE_DIR') or None)
if sys.argv[2:] == ['child']:
    subprocess.check_call([sys.executable, '-c', 'from diff_encoder_sim.room import kernel'])
"""
# Root may write anywhere, unless it has no capabilities.
UNPRIVILEGED = ['setpriv', '--bounding-set=-all', '--inh-caps=-all'] if os.geteuid() == 0 else []


class Run(NamedTuple):
    """Whether a kernel's machine code was found or compiled, where it is kept, and what was said."""

    found: int
    compiled: int
    folder: str
    inherited: str  # what processes that this one starts will use
    said: str


class Installation:
    """A package with one kernel, in a folder that can be made read-only, and a user whose HOME cannot be written."""

    def __init__(self, folder: Path):
        self.folder, self.package, self.tmp = folder, folder / 'lib' / 'diff_encoder_sim', folder / 'tmp'
        shutil.copytree(
            str(SOURCE / 'diff_encoder_sim' / 'base'),
            str(self.package / 'base'),
            ignore=shutil.ignore_patterns('__pycache__'),
        )
        (self.package / 'room').mkdir()
        for init in (self.package, self.package / 'room'):
            (init / '__init__.py').touch()
        (self.package / 'room' / 'kernel.py').write_text(KERNEL)
        self.tmp.mkdir()
        (folder / 'home').mkdir(mode=0o500)

    def protect(self):
        for path in (self.package, *self.package.rglob('*')):
            path.chmod(path.stat().st_mode & ~0o222)

    def call(self, *arguments, **environment):
        places = {'HOME': str(self.folder / 'home'), 'TMPDIR': str(self.tmp), 'PYTHONPATH': str(self.folder / 'lib')}
        run = subprocess.run(
            [*UNPRIVILEGED, sys.executable, '-c', CALL, *(arguments or ['3'])],
            env={'PATH': os.environ['PATH'], **places, **environment},
            cwd=str(self.folder / 'home'),
            capture_output=True,
            text=True,
        )
        assert run.returncode == 0, run.stderr
        found, compiled, folder, inherited = run.stdout.split()
        return Run(int(found), int(compiled), folder, inherited, run.stderr)


@pytest.fixture
def installation(tmp_path):
    installation = Installation(tmp_path)
    yield installation
    for path in (installation.package, *installation.package.rglob('*')):
        path.chmod(0o755)  # so that pytest can remove it


def test_an_installation_that_can_be_written_keeps_its_own(installation):
    run = installation.call()
    assert Path(run.folder) == installation.package / 'room' / '__pycache__'
    assert (run.said, run.inherited) == ('', 'None')


def test_without_a_place_in_home_code_is_kept_in_the_users_temporary_folder_and_that_is_said_once(installation):
    installation.protect()
    first, second = installation.call(), installation.call()
    assert (first.found, first.compiled) == (0, 1)
    assert (second.found, second.compiled) == (1, 0)
    assert first.folder == second.folder and installation.tmp in Path(first.folder).parents
    assert first.inherited == str(Path(first.folder).parent)
    assert len(first.said.splitlines()) == 1 and first.said.endswith(f'{first.inherited}\n')
    assert second.said == ''


def test_the_code_of_an_installation_that_cannot_be_written_is_used_and_more_is_kept_elsewhere(installation):
    installation.call()
    installation.protect()
    same, other, other_again = installation.call(), installation.call('3.0'), installation.call('3.0')
    assert (same.found, same.compiled) == (1, 0)
    assert (other.found, other.compiled) == (0, 1)
    assert (other_again.found, other_again.compiled) == (1, 0)


def test_a_user_with_a_cache_of_his_own_has_it_there_in_silence(installation):
    installation.call()
    installation.protect()
    run = installation.call(XDG_CACHE_HOME=str(installation.folder / 'cache'))
    assert (run.found, run.said) == (1, '')
    assert Path(run.folder).parents[1] == installation.folder / 'cache' / 'diff_encoder_sim'


def test_a_folder_that_the_user_names_is_taken_if_it_can_be_written(installation):
    installation.protect()
    named = installation.call(NUMBA_CACHE_DIR=str(installation.folder / 'named'))
    assert Path(named.folder).parent == installation.folder / 'named'
    unwritable = installation.call(NUMBA_CACHE_DIR=str(installation.folder / 'home' / 'named'))
    assert installation.tmp in Path(unwritable.folder).parents


def test_without_any_place_nothing_is_kept_and_that_is_said(installation):
    installation.protect()
    somebody_elses = installation.tmp / f'diff_encoder_sim-{os.geteuid()}'
    somebody_elses.mkdir()
    somebody_elses.chmod(0o777)
    run = installation.call('3', 'child')
    assert (run.compiled, run.folder) == (1, 'None')
    assert len(run.said.splitlines()) == 1 and 'compiles the kernels anew' in run.said
